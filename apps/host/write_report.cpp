#include "apps/host/write_report.h"

#include <filesystem>
#include <fstream>
#include <system_error>

#include "apps/guarantee/guarantee_report.h"

namespace qduino::apps {

Result<void> write_guarantee(const board::GuaranteeReport& report, const std::string& path) {
    const std::string fresh = path + ".new";
    std::error_code failed;
    std::ofstream file(fresh, std::ios::trunc);
    file << guarantee_json(report) << '\n';
    file.close();
    if (file) std::filesystem::rename(fresh, path, failed);
    if (file && !failed) return {};
    std::error_code ignored;
    std::filesystem::remove(fresh, ignored);
    return make_error(ErrorCode::unavailable, "the guarantee report cannot be written to " + path +
                                                  ": check that its folder is there and yours");
}

}  // namespace qduino::apps
