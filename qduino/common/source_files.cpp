#include "qduino/common/source_files.h"

#include <algorithm>
#include <system_error>

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

bool is_source(const fs::path& path) {
    const fs::path extension = path.extension();
    return extension == ".cpp" || extension == ".cc" || extension == ".c" || extension == ".S";
}

template <typename Iterator>
std::vector<fs::path> collect(Iterator entries, IsWanted is_wanted) {
    std::vector<fs::path> files;
    std::error_code failed;
    for (; !failed && entries != Iterator{}; entries.increment(failed)) {
        const fs::path& path = entries->path();
        const bool hidden = path.filename().string().starts_with(".");
        if constexpr (std::is_same_v<Iterator, fs::recursive_directory_iterator>) {
            if (hidden) entries.disable_recursion_pending();  // src/.git has files like any other
        }
        if (!hidden && is_wanted(path) && entries->is_regular_file(failed)) files.push_back(path);
    }
    std::sort(files.begin(), files.end());
    return files;
}

}  // namespace

SourceKind kind_of(const fs::path& source) {
    if (source.extension() == ".c") return SourceKind::c;
    return source.extension() == ".S" ? SourceKind::assembler : SourceKind::cpp;
}

std::vector<fs::path> files_in(const fs::path& folder, Depth depth, IsWanted is_wanted) {
    std::error_code missing;
    if (depth == Depth::whole_tree)
        return collect(fs::recursive_directory_iterator(folder, missing), is_wanted);
    return collect(fs::directory_iterator(folder, missing), is_wanted);
}

std::vector<fs::path> sources_in(const fs::path& folder, Depth depth) {
    return files_in(folder, depth, is_source);
}

}  // namespace qduino::apps
