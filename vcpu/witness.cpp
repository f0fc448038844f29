#include "vcpu/witness.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/cpu_group.h"
#include "posix/system_error.h"

namespace qduino::apps {
namespace {

using board::linux::block_until;
using board::linux::monotonic_now;

constexpr Nanoseconds kLookAtTreeEvery = 20ms;
constexpr Nanoseconds kDyingTakes = 5s;

/// Closes every descriptor but `a` and `b`: the witness must hold no lock of its keeper.
void keep_only(int a, int b) {
    const auto low = static_cast<unsigned>(std::min(a, b)), high = static_cast<unsigned>(std::max(a, b));
    const auto close_from = [](unsigned first, unsigned last) {
        if (first <= last) ::syscall(SYS_close_range, first, last, 0);
    };
    if (low > 0) close_from(0, low - 1);
    close_from(low + 1, high - 1);
    close_from(high + 1, ~0U);
}

void await_end_of_keeper(int pipe) {
    char nothing = 0;
    while (::read(pipe, &nothing, 1) < 0 && errno == EINTR) {
    }
}

void put_away(const WitnessOrders& orders) {
    const std::string& group = orders.groups.at(0);
    const Instant until = monotonic_now() + orders.grace;
    if (orders.ask) board::linux::signal_group(group, SIGTERM);
    while (!board::linux::members_of_group(group).empty() && monotonic_now() < until)
        block_until(monotonic_now() + kLookAtTreeEvery);
    // What cannot be removed keeps its record: the next start tries again.
    if (board::linux::remove_group(orders.groups, kDyingTakes)) ::unlink(orders.promise.c_str());
}

[[noreturn]] void stand(const WitnessOrders& orders, int pipe) {
    ::setsid();
    ::prctl(PR_SET_NAME, "vcpu-witness");
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGTSTP}) ::signal(signal, SIG_IGN);
    keep_only(pipe, orders.promise_descriptor);
    await_end_of_keeper(pipe);
    put_away(orders);
    ::_exit(0);
}

}  // namespace

Result<posix::UniqueFd> post_witness(const WitnessOrders& orders) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return posix::system_error("make", "a pipe");
    const posix::UniqueFd theirs{ends[0]};
    posix::UniqueFd ours{ends[1]};
    const pid_t between = ::fork();
    if (between < 0) return posix::system_error("start", "the witness of a VCPU");
    if (between == 0) {
        // Twice, so that it is nobody's child whom this process would have to wait for.
        if (::fork() == 0) stand(orders, theirs.get());
        ::_exit(0);
    }
    while (::waitpid(between, nullptr, 0) < 0 && errno == EINTR) {
    }
    return ours;
}

}  // namespace qduino::apps
