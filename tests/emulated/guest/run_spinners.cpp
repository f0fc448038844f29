#include "tests/emulated/guest/run_spinners.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/kernel_text.h"
#include "vcpu/tree_run.h"
#include "vcpu/vcpu_report.h"

namespace qduino::emulated {
namespace {

int fail_spinners(const Error& error) {
    std::printf("emulated: %s\n", std::string{error.message.view()}.c_str());
    return 2;
}

Result<void> run_in_vcpu() {
    QDUINO_TRY_ASSIGN(
        const apps::ProcessVcpu vcpu,
        apps::ProcessVcpu::make({.tree = {.name = "spinners", .core = 0, .budget = 10ms, .period = 100ms}}));
    QDUINO_TRY_ASSIGN(const apps::TreeEnd end, apps::run_tree(vcpu, {"/init", "spin"}, [] {}));
    QDUINO_TRY_ASSIGN(const board::linux::CpuGroupUse use, vcpu.group().use());
    std::printf("vcpu: %s\n", apps::vcpu_json(apps::guarantee_of(vcpu), vcpu.enforced_by(), use, end.lasted,
                                              apps::share_of(use.used, end.lasted))
                                  .c_str());
    return {};
}

}  // namespace

bool is_spinner(int argc, char** argv) {
    if (argc != 2 || std::strcmp(argv[1], "spin") != 0) return false;
    const Instant until = board::linux::monotonic_now() + 2s;
    for (int child = 0; child < 3 && ::fork() != 0; ++child) {
    }
    while (board::linux::monotonic_now() < until) {
    }
    while (::wait(nullptr) > 0 || errno == EINTR) {
    }
    return true;
}

int run_spinners() {
    // In a process of its own, which keeps what run_tree() does to signals.
    const pid_t keeper = ::fork();
    if (keeper == 0) {
        const Result<void> ran = run_in_vcpu();
        const int status = ran ? 0 : fail_spinners(ran.error());
        std::fflush(stdout);
        ::_exit(status);
    }
    int status = 0;
    ::waitpid(keeper, &status, 0);
    if (status != 0) return 2;
    int left = 0;
    for (const std::string& name : board::linux::entries("/sys/fs/cgroup"))
        left += name.starts_with("qduino-vcpu") ? 1 : 0;
    std::printf("emulated: groups left %d\n", left);
    return 0;
}

}  // namespace qduino::emulated
