#include "board/linux/loop/budget_keeper.h"

#include <sched.h>
#include <sys/resource.h>

#include <algorithm>
#include <cerrno>

#include "base/contract.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/real_time_thread.h"

namespace qduino::board::linux {

namespace {

/// Shorter splinters of budget are joined to the next refill: to enforce one costs more.
constexpr Nanoseconds kShortestRun = 20us;
/// The same of what an overrun left of a period. A virtual machine on a busy host takes some 60 us
/// for the timer's interrupt alone.
constexpr Nanoseconds kShortestRest = 100us;
/// The way into the sleep for a spent budget takes some 10 us.
constexpr Nanoseconds kRest = 20us;
/// The timer and its signal take less, also on a busy virtual machine.
constexpr Nanoseconds kPrompt = 500us;
/// The timer is never set shorter: the signal alone takes as long.
constexpr Nanoseconds kShortestTimer = 2us;

long voluntary_switches() {
    rusage usage{};
    ::getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

}  // namespace

thread_local BudgetKeeper* BudgetKeeper::mine_ = nullptr;

// ---- start and stop -----------------------------------------------------------------------------

Result<void> BudgetKeeper::start(const VcpuSpec& spec, int priority, SignsOfLife* life) {
    QDUINO_EXPECT(!running_ && mine_ == nullptr);
    struct sigaction action {};
    action.sa_sigaction = &BudgetKeeper::on_timer;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    sigemptyset(&action.sa_mask);
    ::sigaction(signal_number(), &action, nullptr);

    QDUINO_TRY_ASSIGN(host_.timer, make_thread_timer(signal_number()));
    host_.own_rank.sched_priority = priority;
    host_.life = life;
    host_.budget = spec.budget;
    host_.vcpu = spec.id;
    const Instant now = monotonic_now();
    mine_ = this;
    running_ = true;
    if (spec.is_io()) {
        shell_.start(sched::Pibs{spec.parameters(), now, {}, spec.client_period}, kRest);
    } else if (spec.deferrable) {
        shell_.start(
            sched::DeferrableServer{spec.parameters(), now, std::min(kShortestRest, spec.budget / 2)}, kRest);
    } else {
        sched::SporadicServerOptions options;
        options.shortest_run = std::min(kShortestRun, spec.budget / 4);
        shell_.start(sched::SporadicServer{spec.parameters(), now, options}, kRest);
    }
    shell_.may_overrun(spec.overrun);
    return {};
}

void BudgetKeeper::stop() {
    if (!running_) return;
    running_ = false;
    ::timer_delete(host_.timer);
    mine_ = nullptr;
}

std::string_view BudgetKeeper::tampering() const {
    if (!running_) return {};
    struct sigaction now {};
    ::sigaction(signal_number(), nullptr, &now);
    if (now.sa_handler == SIG_IGN) return "the signal of its budget's timer is ignored";
    if (now.sa_sigaction != &BudgetKeeper::on_timer)
        return "the signal of its budget's timer has another handler";
    itimerspec left{};
    if (::timer_gettime(host_.timer, &left) != 0) return "its budget's timer was deleted";
    return {};
}

// ---- the system ---------------------------------------------------------------------------------

sched::BudgetReading BudgetKeeper::Host::read() {
    const Instant now = monotonic_now();
    return {now, cpu(), voluntary_switches()};
}

Nanoseconds BudgetKeeper::Host::cpu() {
    cpu_read = thread_cpu_time();
    if (cpu_limit > Nanoseconds{0} && cpu_read > cpu_limit + kPrompt) [[unlikely]] {
        beyond_ns.fetch_add(to_ns(cpu_read - cpu_limit), std::memory_order_relaxed);
        cpu_limit = Nanoseconds{0};
    }
    return cpu_read;
}

void BudgetKeeper::Host::set_timer(const sched::BudgetEffect& effect) {
    itimerspec when{};
    int flags = 0;
    cpu_limit = Nanoseconds{0};
    if (effect.kind == sched::BudgetEffect::Kind::arm_in) {
        when.it_value = to_timespec(to_ns(std::max(effect.in, kShortestTimer)));
        cpu_limit = cpu_read + effect.in;
    } else if (effect.kind == sched::BudgetEffect::Kind::arm_at) {
        when.it_value = to_timespec(to_ns(effect.at));
        flags = TIMER_ABSTIME;
        cpu_limit = cpu_read + budget;  // it wakes with no more
    }
    ::timer_settime(timer, flags, &when, nullptr);
}

void BudgetKeeper::Host::sleep_until(Instant t) {
    ++throttled;
    if (life) life->sleeps_for_budget(vcpu, t);
    block_until(t);
}

void BudgetKeeper::on_timer(int, siginfo_t*, void*) {
    BudgetKeeper* self = mine_;
    if (!self || !self->running_) return;  // a shot that was on its way when the keeper stopped
    const int saved_errno = errno;
    if (self->shell_.on_timer()) self->take_change();
    errno = saved_errno;
}

/// An ordinary task, to which the kernel still lends the priority of whoever waits for its lock.
void BudgetKeeper::Host::step_back(bool back) const {
    if (own_rank.sched_priority == 0) return;
    const sched_param none{};
    ::sched_setscheduler(0, (back ? SCHED_OTHER : SCHED_FIFO) | SCHED_RESET_ON_FORK,
                         back ? &none : &own_rank);
}

}  // namespace qduino::board::linux
