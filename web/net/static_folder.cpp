#include "web/net/static_folder.h"

#include "posix/small_file.h"

namespace qduino::web {

Result<StaticFiles> read_static_folder(const std::filesystem::path& folder) {
    StaticFiles::Found found;
    std::uint64_t total = 0;
    std::error_code failed;
    for (const auto& entry : std::filesystem::recursive_directory_iterator{folder, failed}) {
        if (entry.is_symlink() || !entry.is_regular_file()) continue;
        Result<std::string> bytes = posix::read_small_file(entry.path());
        total += bytes ? bytes->size() : 0;
        if (!bytes || total > kStaticBytesMax || found.size() >= kStaticFilesMax) {
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
