#include "qduino/upload/sketch_parcel.h"

#include <algorithm>
#include <string>
#include <system_error>

#include "qduino/common/child_process.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// Copies the regular files and folders of `from`, but none that is hidden or in `left_out`.
std::error_code copy_tree(const fs::path& from, const fs::path& to,
                          const std::vector<std::string>& left_out) {
    std::error_code failed;
    fs::create_directories(to, failed);
    for (fs::directory_iterator at{from, failed}, end; !failed && at != end; at.increment(failed)) {
        const std::string name = at->path().filename().string();
        if (name.starts_with('.') || std::ranges::find(left_out, name) != left_out.end()) continue;
        if (at->is_directory())
            failed = copy_tree(at->path(), to / name, {});
        else if (at->is_regular_file())
            fs::copy_file(at->path(), to / name, failed);
        if (failed) return failed;
    }
    return failed;
}

}  // namespace

Result<void> pack_sketch(const Sketch& sketch, const std::vector<Library>& libraries,
                         const fs::path& folder) {
    const fs::path packed = folder / sketch.name;
    const bool whole = sketch.folder.filename() == sketch.name;
    std::error_code failed;
    if (whole) failed = copy_tree(sketch.folder, packed, {"libraries", "compile_commands.json"});
    fs::create_directories(packed / "libraries", failed);
    for (const fs::path& tab : sketch.tabs) {
        if (!whole && !failed) fs::copy_file(tab, packed / tab.filename(), failed);
    }
    for (const Library& library : libraries) {
        const fs::path place = packed / "libraries" / library.folder.filename();
        if (!failed) failed = copy_tree(library.folder, place, {"examples", "extras", "test", "tests"});
    }
    if (failed)
        return make_error(ErrorCode::unavailable, sketch.name, " cannot be packed: ", failed.message());
    return {};
}

Result<fs::path> unpack_sketch(const fs::path& folder) {
    std::error_code failed;
    fs::remove_all(folder, failed);
    fs::create_directories(folder, failed);
    // -m: what is built is judged by times, and a file may have become an older one.
    QDUINO_TRY_ASSIGN(const int status,
                      run_in_front({"tar", "-C", folder.string(), "--no-same-owner", "-xzmf", "-"}));
    if (status == 0) {
        for (const fs::directory_entry& entry : fs::directory_iterator{folder, failed}) {
            if (entry.is_directory()) return entry.path();
        }
    }
    return make_error(ErrorCode::corrupt,
                      "what came on standard input is no sketch: use 'qduino upload --to'");
}

}  // namespace qduino::apps
