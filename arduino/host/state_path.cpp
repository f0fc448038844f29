#include "arduino/host/state_path.h"

#include <cstdlib>
#include <filesystem>

namespace qduino::arduino::host {

std::string state_path(const char* variable, std::string_view ending) {
    if (const char* set = std::getenv(variable)) return set;
    const char* state = std::getenv("XDG_STATE_HOME");
    const char* home = std::getenv("HOME");
    const std::filesystem::path root = state  ? std::filesystem::path(state)
                                       : home ? std::filesystem::path(home) / ".local/state"
                                              : std::filesystem::path("/var/tmp");
    std::error_code ignored;  // what cannot be made is said when the file cannot be opened
    std::filesystem::create_directories(root / "qduino", ignored);
    const auto program = std::filesystem::read_symlink("/proc/self/exe", ignored).filename();
    return root / "qduino" / ((program.empty() ? "sketch" : program.string()) += ending);
}

}  // namespace qduino::arduino::host
