#include "board/linux/budget_keeper.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>

#include "base/contract.h"
#include "board/linux/clock.h"
#include "posix/system_error.h"

// glibc names the field only from 2.38 on.
#ifndef sigev_notify_thread_id
#define sigev_notify_thread_id _sigev_un._tid
#endif

namespace qduino::board::linux {

using posix::system_error;
namespace {

/// Splinters of budget shorter than this are joined to the next refill: enforcing one costs more than it.
constexpr Nanoseconds kShortestRun = 20us;
/// The timer is never set shorter: the signal alone takes as long.
constexpr Nanoseconds kShortestTimer = 2us;

long voluntary_switches() {
    rusage usage{};
    ::getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_nvcsw;
}

}  // namespace

thread_local BudgetKeeper* BudgetKeeper::mine_ = nullptr;

// ---- the server, whichever it is ------------------------------------------------------------------------

Nanoseconds BudgetKeeper::available(Instant now) const {
    return std::visit([now](const auto& server) { return server.available(now); }, server_);
}
Instant BudgetKeeper::next_replenishment() const {
    return std::visit([](const auto& server) { return server.next_replenishment(); }, server_);
}
void BudgetKeeper::server_block(Instant now) {
    if (auto* main = std::get_if<sched::SporadicServer>(&server_)) main->block(now);
    if (auto* io = std::get_if<sched::Pibs>(&server_)) io->finish(now);
}
void BudgetKeeper::unblock(sched::SporadicServer& server, Instant now) const { server.unblock(now); }
void BudgetKeeper::unblock(sched::Pibs& server, Instant now) const { server.activate(now, period_); }
void BudgetKeeper::server_unblock(Instant now) {
    std::visit([&](auto& server) { unblock(server, now); }, server_);
}

// ---- start and stop -------------------------------------------------------------------------------------

Result<void> BudgetKeeper::start(const VcpuSpec& spec) {
    QDUINO_EXPECT(!running_ && mine_ == nullptr);
    struct sigaction action {};
    action.sa_sigaction = &BudgetKeeper::on_timer;
    action.sa_flags = SA_SIGINFO | SA_RESTART;
    sigemptyset(&action.sa_mask);
    ::sigaction(signal_number(), &action, nullptr);

    sigevent event{};
    event.sigev_notify = SIGEV_THREAD_ID;
    event.sigev_signo = signal_number();
    event.sigev_notify_thread_id = static_cast<pid_t>(::syscall(SYS_gettid));
    if (::timer_create(CLOCK_MONOTONIC, &event, &timer_) != 0) return system_error("make", "a budget timer");

    const sched::VcpuParameters parameters{spec.budget, spec.period};
    const Instant now = monotonic_now();
    if (spec.kind == VcpuKind::io) {
        server_ = sched::Pibs{parameters, now};
    } else {
        sched::SporadicServerOptions options;
        options.shortest_run = std::min(kShortestRun, spec.budget / 4);
        server_ = sched::SporadicServer{parameters, now, options};
    }
    period_ = spec.period;
    budget_ = spec.budget;
    server_unblock(now);
    cpu_before_ = thread_cpu_time();
    switches_before_ = voluntary_switches();
    settled_at_ = now;
    mine_ = this;
    running_ = true;
    arm(available(now));
    return {};
}

void BudgetKeeper::stop() {
    if (!running_) return;
    running_ = false;
    ::timer_delete(timer_);
    mine_ = nullptr;
}

// ---- the account ----------------------------------------------------------------------------------------

/// The account's time never runs back, though wake-ups are told by the cycle clock, which may be some 20 ns off.
Instant BudgetKeeper::account_now() const { return std::max(monotonic_now(), settled_at_); }

/// Tells the server of a wake-up that it has not been told of yet. Until something is charged it need not know, and the way from the
/// wake-up to the loop is short without it.
void BudgetKeeper::take_up_work() {
    if (!woken_) return;
    woken_ = false;
    server_unblock(settled_at_);
    if (!analysed_wait(settled_at_)) charge(settled_at_, cpu_at_wake_ - cpu_before_);
    cpu_before_ = cpu_at_wake_;
}

/// The way into a wait and out of it is not the budget's once in a period (twice after a period without): so the analysis has it. What
/// makes it longer than that is not the loop's doing: an interrupt, or the host.
bool BudgetKeeper::analysed_wait(Instant now) {
    if (next_analysed_ - period_ > now) return false;
    next_analysed_ = std::max(next_analysed_, now) + period_;
    return true;
}

void BudgetKeeper::charge(Instant now, Nanoseconds used) {
    std::visit([&](auto& server) { static_cast<void>(server.consume(now, used)); }, server_);
    charged_ns_.store(charged_ns_.load(std::memory_order_relaxed) + to_ns(used), std::memory_order_relaxed);
}

/// CPU time since the last settlement. Two clocks are read one after the other: never more than the time that passed.
Nanoseconds BudgetKeeper::used_until(Instant now) const {
    return std::clamp(thread_cpu_time() - cpu_before_, Nanoseconds{0}, now - settled_at_);
}

void BudgetKeeper::charge_run(Instant now, Nanoseconds used) {
    charge(now, used);
    cpu_before_ += used;
    settled_at_ = now;
}

/// Charges what was used since the last settlement.
void BudgetKeeper::settle(Instant now) {
    take_up_work();
    const Nanoseconds used = used_until(now);
    const long switches = voluntary_switches();
    if (switches != switches_before_) {  // it waited for something, unannounced
        server_block(settled_at_);
        server_unblock(std::max(settled_at_, now - used));
    }
    charge_run(now, used);
    switches_before_ = switches;
}

void BudgetKeeper::arm(Nanoseconds in) {
    itimerspec when{};
    if (in > Nanoseconds{0}) when.it_value = to_timespec(to_ns(std::max(in, kShortestTimer)));
    ::timer_settime(timer_, 0, &when, nullptr);
}

/// Sleeps until there is budget, if there is none, and sets the timer to its end.
void BudgetKeeper::throttle_and_arm() {
    take_up_work();
    Instant now = account_now();
    while (available(now) <= Nanoseconds{0}) {
        if (overrun_while_holding()) return;
        throttled_.store(throttled_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
        block_until(next_replenishment());
        now = account_now();
        // This sleep is the account's own and no wait of the thread's; the instructions around it are charged as any.
        charge_run(now, used_until(now));
        switches_before_ = voluntary_switches();
    }
    arm(available(now));
}

/// True: it holds a lock and may go on; the timer is set to the end of that.
bool BudgetKeeper::overrun_while_holding() {
    if (locks_held_ == 0) return false;
    if (overrunning_ == 0) overrun_ends_ = cpu_before_ + budget_;
    overrunning_ = 1;
    if (overrun_ends_ <= cpu_before_) return false;
    arm(overrun_ends_ - cpu_before_);
    return true;
}

void BudgetKeeper::on_timer(int, siginfo_t*, void*) {
    BudgetKeeper* self = mine_;
    if (!self || !self->running_) return;  // a shot that was on its way when the keeper stopped
    if (self->busy_ != 0) {
        self->missed_ = 1;
        return;
    }
    const int saved_errno = errno;
    self->settle(self->account_now());
    self->throttle_and_arm();
    errno = saved_errno;
}

// ---- announced waits ------------------------------------------------------------------------------------

void BudgetKeeper::before_block(Instant until) {
    if (!running_) return;
    busy_ = 1;
    const Instant now = account_now();
    settle(now);
    server_block(now);
    missed_ = 0;
    armed_ahead_ = arm_for_wake(now, until);
    switches_before_ +=
        1;  // the wait to come; should there be none, settle() finds a wait that was none: no harm
}

/// Sets the timer to where the budget will end if the thread wakes at `until`, so that nothing stands between the wake-up and the loop:
/// setting it then would cost a system call and, in a virtual machine, an exit. A later wake makes the shot an early one.
bool BudgetKeeper::arm_for_wake(Instant now, Instant until) {
    if (until == kForever || until <= now) {
        arm(Nanoseconds{0});  // disarmed: while it waits it needs no timer
        return false;
    }
    auto then = server_;
    const Nanoseconds budget = std::visit(
        [&](auto& server) {
            unblock(server, until);
            return server.available(until);
        },
        then);
    if (budget <= Nanoseconds{0}) {
        arm(Nanoseconds{0});
        return false;
    }
    const itimerspec when{.it_interval = {}, .it_value = to_timespec(to_ns(until + budget))};
    ::timer_settime(timer_, TIMER_ABSTIME, &when, nullptr);
    return true;
}

void BudgetKeeper::after_block(Instant now) {
    if (!running_) return;
    settled_at_ = std::max(settled_at_, now);
    cpu_at_wake_ = thread_cpu_time();
    woken_ = true;
    // Armed ahead: there will have been budget at the instant that was waited for, and there is no less of it later.
    if (armed_ahead_ && missed_ == 0) {
        busy_ = 0;
        if (missed_ == 0) return;
        busy_ = 1;  // the timer came between the last two lines
    }
    leave_ordinary_path();
}

/// Contract: busy.
void BudgetKeeper::leave_ordinary_path() {
    missed_ = 0;
    throttle_and_arm();
    busy_ = 0;
    if (missed_ != 0) on_timer(0, nullptr, nullptr);  // the budget ended between the last two lines
}

// ---- locks ----------------------------------------------------------------------------------------------

void BudgetKeeper::begin_hold() { locks_held_ = locks_held_ + 1; }

void BudgetKeeper::end_hold() {
    locks_held_ = locks_held_ - 1;
    if (!running_ || locks_held_ > 0 || overrunning_ == 0) return;
    busy_ = 1;
    overrunning_ = 0;
    settle(account_now());
    leave_ordinary_path();
}

}  // namespace qduino::board::linux
