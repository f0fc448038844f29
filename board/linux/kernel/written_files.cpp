#include "board/linux/kernel/written_files.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "board/linux/kernel/kernel_text.h"
#include "posix/system_error.h"

namespace qduino::board::linux {
namespace {

/// A folder of which only a part may be written, and the names in it that may not.
struct Exception {
    std::string_view folder;
    std::array<std::string_view, 3> left_out;
};
constexpr std::array kExceptions{Exception{"/", {"proc", "sys"}},
                                 Exception{"/sys/", {"devices", "fs", "kernel"}},
                                 Exception{"/sys/devices/", {"system"}}};
constexpr const char* kInterrupts = "/proc/irq";

void allow(int rules, const std::string& path) {
    const posix::UniqueFd folder{::open(path.c_str(), O_PATH | O_CLOEXEC)};
    if (!folder.valid()) return;
    landlock_path_beneath_attr rule{};
    rule.allowed_access = LANDLOCK_ACCESS_FS_WRITE_FILE;
    rule.parent_fd = folder.get();
    ::syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
}

}  // namespace

Result<posix::UniqueFd> rules_for_written_files() {
    landlock_ruleset_attr handled{};
    handled.handled_access_fs = LANDLOCK_ACCESS_FS_WRITE_FILE;
    posix::UniqueFd rules{
        static_cast<int>(::syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0))};
    if (!rules.valid()) {
        return make_error(ErrorCode::unsupported,
                          "this kernel has no Landlock, or it is off: see `qduino doctor`");
    }
    for (const Exception& exception : kExceptions) {
        for (const std::string& name : entries(std::string{exception.folder})) {
            if (std::ranges::find(exception.left_out, name) == exception.left_out.end())
                allow(rules.get(), std::string{exception.folder} + name);
        }
    }
    allow(rules.get(), kInterrupts);
    return rules;
}

void restrict_written_files(int rules) { ::syscall(SYS_landlock_restrict_self, rules, 0); }

}  // namespace qduino::board::linux
