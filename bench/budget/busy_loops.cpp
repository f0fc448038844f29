#include "bench/budget/busy_loops.h"

#include <sched.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>

#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/deadline_class.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"
#include "board/linux/loop/budget_keeper.h"

namespace qduino::bench {
namespace {

using namespace board::linux;

/// A spinner's notes: for each burst its start, its end, and the thread's CPU time at its start.
class BurstLog {
  public:
    BurstLog(BudgetCase budget, Nanoseconds length)
        : gap_((budget.period - budget.budget) / 2),
          samples_(3 * static_cast<std::size_t>(4 * (length / budget.period) + 1000)) {}

    /// Spins until `end`.
    void spin(Instant end) {
        Instant start = monotonic_now();
        Nanoseconds cpu = thread_cpu_time();
        Instant last = start;
        while (last < end && !samples_.full()) {
            const Instant now = monotonic_now();
            if (now - last > gap_) {
                note(start, last, cpu);
                start = now;
                cpu = thread_cpu_time();
            }
            last = now;
        }
    }

    /// The run's ends cut off the first and the last burst, so those are left out.
    void summarise(Bursts& bursts) const {
        const std::vector<std::int64_t> taken = samples_.taken();
        const std::size_t count = taken.size() / 3;
        if (count < 4) {
            bursts.failure = "never held back: " + std::to_string(count) + " bursts";
            return;
        }
        std::int64_t in_bursts = 0;
        for (std::size_t i = 1; i + 1 < count; ++i) {
            bursts.lengths_ns.push_back(taken[3 * i + 1] - taken[3 * i]);
            in_bursts += bursts.lengths_ns.back();
        }
        const std::size_t first = 3, last = 3 * (count - 1);
        const std::int64_t cpu = taken[last + 2] - taken[first + 2];
        bursts.utilisation = static_cast<double>(cpu) / static_cast<double>(taken[last] - taken[first]);
        bursts.overhead_ns = static_cast<double>(cpu - in_bursts) / static_cast<double>(count - 2);
    }

  private:
    void note(Instant start, Instant end, Nanoseconds cpu) {
        samples_.push(to_ns(start));
        samples_.push(to_ns(end));
        samples_.push(to_ns(cpu));
    }
    Nanoseconds gap_;
    SharedSamples samples_;
};

struct Spinner {
    BurstLog* log;
    Nanoseconds length;
};

void spin_entry(void* context) {
    const Spinner& spinner = *static_cast<const Spinner*>(context);
    spinner.log->spin(monotonic_now() + spinner.length);
}

int play_sporadic_server(BurstLog& log, BudgetCase budget, Nanoseconds length,
                         const GuaranteeFile& guarantee) {
    auto opened = LinuxBoard::open({});
    if (!opened) return cannot(opened.error());
    LinuxBoard& board = *opened.value();
    Spinner spinner{.log = &log, .length = length};
    board::VcpuSpec spec{{1, budget.budget, budget.period, board.core_count() - 1}};
    spec.entry = &spin_entry;
    spec.context = &spinner;
    if (const auto started = board.start(std::span{&spec, 1}); !started) return cannot(started.error());
    guarantee.write(board.guarantee());
    board.request_stop();
    board.run(board.now() + length + 2s);
    return 0;
}

/// Its handler needs these; a process has one such thread.
struct BareTimer {
    timer_t timer{};
    itimerspec budget{};
    Instant next{};
    Nanoseconds period{};
};
BareTimer bare_timer;

void sleep_to_the_grid(int) {
    while (bare_timer.next <= monotonic_now()) bare_timer.next += bare_timer.period;
    block_until(bare_timer.next);
    ::timer_settime(bare_timer.timer, 0, &bare_timer.budget, nullptr);
}

int play_bare_timer(BurstLog& log, BudgetCase budget, Nanoseconds length) {
    static_cast<void>(::mlockall(MCL_CURRENT | MCL_FUTURE));
    const LinuxConfig as_the_board{};
    if (!pin_to_core(cpu_count() - 1) || !become_real_time(as_the_board.priority_highest)) return EPERM;
    struct sigaction action {};
    action.sa_handler = &sleep_to_the_grid;
    ::sigaction(BudgetKeeper::signal_number(), &action, nullptr);
    auto timer = make_thread_timer(BudgetKeeper::signal_number());
    if (!timer) return EAGAIN;
    bare_timer = {timer.value(), {}, monotonic_now(), budget.period};
    bare_timer.budget.it_value = to_timespec(to_ns(budget.budget));
    ::timer_settime(bare_timer.timer, 0, &bare_timer.budget, nullptr);
    log.spin(monotonic_now() + length);
    ::timer_delete(bare_timer.timer);
    return 0;
}

int play_sched_deadline(BurstLog& log, BudgetCase budget, Nanoseconds length) {
    static_cast<void>(::mlockall(MCL_CURRENT | MCL_FUTURE));
    if (const int error = give_deadline_class(0, budget.budget, budget.period); error != 0) return error;
    log.spin(monotonic_now() + length);
    return 0;
}

Bursts summary(const BurstLog& log, std::string failure) {
    Bursts bursts;
    bursts.failure = std::move(failure);
    if (bursts.failure.empty()) log.summarise(bursts);
    return bursts;
}

}  // namespace

Bursts run_under_sporadic_server(BudgetCase budget, Nanoseconds length) {
    BurstLog log{budget, length};
    const GuaranteeFile guarantee;
    Bursts bursts = summary(
        log, run_child([&] { return play_sporadic_server(log, budget, length, guarantee); }, length + 5s));
    bursts.guarantee = guarantee.read();
    return bursts;
}

Bursts run_under_bare_timer(BudgetCase budget, Nanoseconds length) {
    BurstLog log{budget, length};
    return summary(log, run_child([&] { return play_bare_timer(log, budget, length); }, length + 5s));
}

Bursts run_under_sched_deadline(BudgetCase budget, Nanoseconds length) {
    BurstLog log{budget, length};
    std::string failure = run_child([&] { return play_sched_deadline(log, budget, length); }, length + 5s);
    const auto ended_with = [&](int error) {
        return failure == "ended with status " + std::to_string(error);
    };
    if (ended_with(EPERM)) failure = "SCHED_DEADLINE is for root";
    if (ended_with(EBUSY)) failure = "the kernel refuses SCHED_DEADLINE: no bandwidth free (EBUSY)";
    return summary(log, std::move(failure));
}

}  // namespace qduino::bench
