// The page's files from a folder: where there is a disk.
#include "posix/small_file.h"
#include "web/static_files.h"

namespace qduino::web {

Result<StaticFiles> StaticFiles::read(const std::filesystem::path& folder) {
    Found found;
    std::uint64_t total = 0;
    std::error_code failed;
    for (const auto& entry : std::filesystem::recursive_directory_iterator{folder, failed}) {
        if (entry.is_symlink() || !entry.is_regular_file()) continue;
        Result<std::string> bytes = posix::read_small_file(entry.path());
        total += bytes ? bytes->size() : 0;
        if (!bytes || total > kBytesMax || found.size() >= kFilesMax) {
            return make_error(ErrorCode::out_of_range,
                              "the page's files are too many, too large or not readable");
        }
        found[std::filesystem::relative(entry.path(), folder).generic_string()] =
            std::make_shared<const std::string>(std::move(*bytes));
    }
    if (failed) return make_error(ErrorCode::not_found, "no folder of the page's files: ", folder.native());
    return StaticFiles{found};
}

}  // namespace qduino::web
