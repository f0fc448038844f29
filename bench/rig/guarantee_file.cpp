#include "bench/rig/guarantee_file.h"

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "report/guarantee_report.h"

namespace qduino::bench {

GuaranteeFile::GuaranteeFile()
    : path_("/dev/shm/qduino-bench-" + std::to_string(::getpid()) + ".guarantee") {}

GuaranteeFile::~GuaranteeFile() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
}

void GuaranteeFile::write(const board::GuaranteeReport& report) const {
    // If the report is missing, its reader notices.
    static_cast<void>(apps::write_guarantee(report, path_));
}

Json GuaranteeFile::read() const {
    std::ifstream file{path_};
    return Json::parse(file, nullptr, false);
}

}  // namespace qduino::bench
