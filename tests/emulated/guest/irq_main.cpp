// The sketch irq/ beside a serial line that is never quiet once the loops run: its interrupts are
// threaded, for this is a real-time kernel, and their thread wants more than the I/O VCPU's budget.
// Before, it is quiet: admission measures what interrupts take of the core, and an emulated
// processor has nothing but them for a busy line.
//
//   writer ──► /dev/ttyS1 ──► irq/N-ttyS1      the rank of the I/O VCPU while it has budget,
//                                              an ordinary task's while it has none
//
// A witness looks at the kernel's own word about that thread (its scheduling class, by the
// system call that `chrt -p` makes) every millisecond or two, and prints what it saw:
//
//   witness: irq/N-ttyS1 before 1 50, during 1 R for A looks and 0 0 for B, other C, after 1 50
//
#include <fcntl.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <new>
#include <string>

#include "base/whole_number.h"
#include "board/linux/kernel/kernel_text.h"
#include "tests/emulated/guest/guest_init.h"
#include "tests/emulated/guest/run_sketch.h"

namespace {

using namespace qduino;

constexpr const char* kLine = "/dev/ttyS1";

/// A child that ends with its parent.
template <typename Work>
pid_t start(Work work) {
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    work();
    ::_exit(0);
}

void end(pid_t child) {
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
}

struct Rank {
    int policy = -1;
    int priority = 0;
    constexpr bool operator==(const Rank&) const = default;
};

Rank rank_of(pid_t tid) {
    sched_param parameters{};
    const int policy = ::sched_getscheduler(tid) & ~SCHED_RESET_ON_FORK;
    ::sched_getparam(tid, &parameters);
    return {policy, parameters.sched_priority};
}

/// What the witness saw. In memory that all processes here share.
struct Seen {
    Rank ranked{};  // the first rank that was neither the kernel's nor an ordinary task's
    std::atomic<int> with_rank{0};
    std::atomic<int> without{0};
    std::atomic<int> with_another{0};
};

/// Keeps the line busy for ever, once its interrupt's thread has the rank of the I/O VCPU. The
/// thread is there from the open on.
void write_for_ever(const Seen& seen) {
    const int line = ::open(kLine, O_WRONLY | O_NOCTTY | O_CLOEXEC);
    termios settings{};
    if (line < 0 || ::tcgetattr(line, &settings) != 0) return std::perror(kLine);
    ::cfmakeraw(&settings);
    ::cfsetspeed(&settings, B115200);
    ::tcsetattr(line, TCSANOW, &settings);
    while (seen.with_rank == 0) ::usleep(1000);
    std::array<char, 4096> text{};
    while (::write(line, text.data(), text.size()) > 0) {
    }
}

/// 0: there is none (yet).
pid_t thread_of_the_line() {
    for (const std::string& entry : board::linux::entries("/proc")) {
        const auto tid = whole_number<pid_t>(entry);
        const std::string name = tid ? board::linux::text_of_file("/proc/" + entry + "/comm") : "";
        if (name.starts_with("irq/") && name.find("ttyS1") != std::string::npos) return *tid;
    }
    return 0;
}

void look_for_ever(pid_t tid, Rank before, Seen& seen) {
    for (;; ::usleep(1000)) {
        const Rank now = rank_of(tid);
        if (now == before) continue;
        if (now == Rank{SCHED_OTHER, 0}) {
            ++seen.without;
        } else if (seen.ranked == Rank{} || now == seen.ranked) {
            seen.ranked = now;
            ++seen.with_rank;
        } else {
            ++seen.with_another;
        }
    }
}

int run_beside_a_busy_line() {
    void* const shared =
        ::mmap(nullptr, sizeof(Seen), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) return 2;
    Seen& seen = *new (shared) Seen;
    const pid_t writer = start([&] { write_for_ever(seen); });
    pid_t thread = 0;
    for (int tries = 0; thread == 0 && tries < 200; ++tries, ::usleep(10'000)) thread = thread_of_the_line();
    if (thread == 0) {
        std::puts("emulated: the serial line has no interrupt thread");
        return 2;
    }
    const Rank before = rank_of(thread);
    // It goes when the line is closed.
    const std::string name = board::linux::text_of_file("/proc/" + std::to_string(thread) + "/comm");
    const pid_t witness = start([&] { look_for_ever(thread, before, seen); });
    const int result = emulated::run_sketch({}, std::chrono::seconds{120});
    end(witness);
    const Rank after = rank_of(thread);
    end(writer);
    std::printf("witness: %s before %d %d, during %d %d for %d looks and 0 0 for %d, other %d, after %d %d\n",
                name.c_str(), before.policy, before.priority, seen.ranked.policy, seen.ranked.priority,
                seen.with_rank.load(), seen.without.load(), seen.with_another.load(), after.policy,
                after.priority);
    return result;
}

}  // namespace

int main() { return emulated::run_as_init(run_beside_a_busy_line); }
