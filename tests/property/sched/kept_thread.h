// A thread that is kept to its budget, tick by tick: its clocks, its timer and the signal that the
// timer sends. It keeps the truth about the thread apart from the belief of its account.
//
//   run ──┐                      ┌─ the shell of the account, whose host this is: each time that it
//   wait ─┤ the thread ─ ticks ──┤  asks for a clock, sets the timer or sleeps, time may pass, and
//   lock ─┘                      │  the timer may come
//                                └─ the truth: a list of tokens, one spent for each tick at once
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "sched/budget_shell.h"
#include "tests/oracle/sched/naive_budget_account.h"

namespace qduino::sched {

struct KeptShape {
    std::int64_t budget;
    std::int64_t period;
    std::int64_t way;  ///< ticks of CPU time into an announced wait, and as many out of it
};

inline std::int64_t consumed_by(const BudgetAccount& account) { return account.server().consumed().count(); }
template <oracle::BudgetRules kRules>
std::int64_t consumed_by(const oracle::NaiveBudgetAccount<kRules>& account) {
    return account.consumed();
}

/// `ShellOf<Host>` keeps it; `Ways` decides (choices.h). At most `delays` times a tick passes
/// within the shell.
template <template <typename> class ShellOf, typename Ways>
class KeptThread {
  public:
    KeptThread(const KeptShape& shape, Ways& ways, int delays)
        : shape_(shape), ways_(ways), shell_(*this), truth_(shape.budget, shape.period, 0) {
        shell_.start(SporadicServer{{Nanoseconds{shape.budget}, Nanoseconds{shape.period}}});
        delays_ = delays;
    }

    void step() {
        switch (ways_.pick(8)) {
            case 0:
                return run(1);
            case 1:
                return run(4);
            case 2:
                return preempt(3);
            case 3:
                return wait(instant_from_ns(now_ + 2 + shape_.way), 0);
            case 4:
                return wait(instant_from_ns(now_ + 3), shape_.budget + 1);
            case 5:
                return wait(kForever, 3);
            case 6:
                return wait_silently(2);
            default:
                return locks_ > 0 ? unlock() : lock();
        }
    }
    /// Runs long enough for a lost timer to show, and looks whether all time was charged. The first
    /// thing that is wrong, or "".
    std::string finish() {
        run(2 * shape_.budget + 2);
        if (locks_ > 0) unlock();
        run(shape_.budget + 2);
        delays_ = 0;
        interrupt();
        const std::int64_t lost = cpu_ - forgiven_ - consumed_by(shell_.account());
        if (lost != 0 && !(skewed_ && lost >= -dawdled_ && lost <= dawdled_)) {
            break_rule(std::to_string(lost) + " ticks lost");
        }
        return broken_;
    }

    // ---- the host of the shell
    BudgetReading read() {
        dawdle();
        last_now_ = now_;
        const std::int64_t cpu_then = cpu_;
        dawdle();
        skewed_ |= cpu_ != cpu_then;
        const BudgetReading reading{instant_from_ns(last_now_), Nanoseconds{cpu_}, switches_};
        take_way_of_throttling();
        cpu_read_ = cpu_;
        if (entering_wait_) in_way_ = true;
        entering_wait_ = false;
        dawdle();
        return reading;
    }
    Nanoseconds cpu() {
        dawdle();
        in_way_ = false;
        cpu_read_ = cpu_;
        const Nanoseconds reading{cpu_};
        dawdle();
        return reading;
    }
    void set_timer(const BudgetEffect& effect) {
        dawdle();
        due_.reset();
        if (effect.kind == BudgetEffect::Kind::arm_in) due_ = now_ + effect.in.count();
        if (effect.kind == BudgetEffect::Kind::arm_at) due_ = to_ns(effect.at);
        dawdle();
    }
    void step_back(bool back) { stepped_back_ = back; }
    void sleep_until(Instant until) {
        if (stepped_back_) break_rule("it sleeps without a rank");
        check_throttling(to_ns(until));
        sleep_to(to_ns(until));
        dawdle();
        slept_for_budget_ = true;
    }

  private:
    // ---- what the thread does
    void run(std::int64_t ticks) {
        for (; ticks > 0; --ticks) {
            tick(Use::own);
        }
    }
    void preempt(std::int64_t ticks) {
        for (; ticks > 0; --ticks) tick(Use::none);
    }
    void wait(Instant until, std::int64_t longer) {
        entering_wait_ = true;
        way_ = 0;
        shell_.before_wait(until);
        wait_was_due_ = std::max(to_ns(until), last_now_);
        for (std::int64_t i = 0; i < shape_.way; ++i) tick(Use::shell);
        sleep_to((until == kForever ? now_ : to_ns(until)) + longer);
        for (std::int64_t i = 0; i < shape_.way; ++i) tick(Use::shell);
        last_now_ = now_;
        woke_at_ = now_;
        shell_.after_wait(instant_from_ns(now_));
        take_way();
    }
    void wait_silently(std::int64_t ticks) {
        silent_ = true;
        sleep_to(now_ + ticks);
        truth_.wake(now_);
    }
    void lock() {
        shell_.begin_hold();
        ++locks_;
        ran_since_overrun_ = 0;
    }
    void unlock() {
        --locks_;
        shell_.end_hold();
    }

    // ---- time
    enum class Use {
        none,
        shell,
        own
    };  // of a tick: for the thread itself, or for the shell and its system calls
    void tick(Use use) {
        ++now_;
        if (use != Use::none) {
            ++cpu_;
            take_way();
            if (in_way_) {
                ++way_;
            } else {
                spend(now_ - 1);
            }
            if (use == Use::own) check_run();
        }
        interrupt_if_due();
    }
    void dawdle() {
        if (delays_ == 0) return;
        const int what = ways_.pick(3);
        if (what == 0) return;
        --delays_;
        ++dawdled_;
        tick(what == 1 ? Use::shell : Use::none);
    }
    /// A signal ends no sleep of the thread's, but it runs the handler, and the thread sleeps once
    /// more.
    void sleep_to(std::int64_t until) {
        // A wait that was none: the account takes it for a silent one elsewhere.
        silent_ |= until <= now_;
        while (now_ < until) {
            const bool shot = due_ && *due_ < until && !in_handler_;
            now_ = shot ? std::max(now_, *due_) : until;
            ++switches_;
            silent_ |= shot;
            interrupt_if_due();
        }
    }
    void interrupt_if_due() {
        while (due_ && *due_ <= now_ && !in_handler_) {
            due_.reset();
            interrupt();
        }
    }
    void interrupt() {
        in_handler_ = true;
        shell_.on_timer();
        in_handler_ = false;
    }

    // ---- the truth
    /// What the way through the last wait cost is the thread's, or admission's.
    void take_way() {
        if (!woke_at_ || in_way_) return;
        const std::int64_t woke = *woke_at_;
        woke_at_.reset();
        if (bucket_.admits(woke)) {
            forgiven_ += way_;
            return truth_.wake(std::min(wait_was_due_, woke));
        }
        truth_.wake(std::min(wait_was_due_, woke - way_));
        for (; way_ > 0; --way_) spend(woke - way_);
    }
    /// So is what the way through the last sleep for a spent budget cost. The truth spends it in
    /// either case: it stands for at most so much more as the shell dawdled.
    void take_way_of_throttling() {
        if (!slept_for_budget_) return;
        slept_for_budget_ = false;
        if (bucket_.admits(last_now_)) forgiven_ += cpu_ - cpu_read_;
    }
    /// A tick that began at `now` takes the next token: lent to it, if that is not due yet.
    void spend(std::int64_t now) {
        if (!truth_.may_run(now)) lent_.push_back(truth_.tokens().front());
        while (!lent_.empty() && lent_.front() <= now) lent_.pop_front();
        if (locks_ > 0 && (!lent_.empty() || ran_since_overrun_ > 0)) ++ran_since_overrun_;
        truth_.spend_one();
    }
    /// How far a thread may run ahead of its tokens for other reasons than a lock.
    [[nodiscard]] std::int64_t slack() const { return dawdled_ + 2 * shape_.way; }
    /// Called in each tick of the thread's own.
    void check_run() {
        const std::int64_t lent = static_cast<std::int64_t>(lent_.size());
        if (locks_ == 0 && lent > slack()) break_rule("ran on without budget");
        if (locks_ == 0 && stepped_back_) break_rule("has no rank, and no lock");
        if (lent > slack() && !stepped_back_) break_rule("ran on without budget, at its rank");
        if (lent > shape_.budget + slack()) break_rule("ran on with a lock for more than a budget");
    }
    void check_throttling(std::int64_t until) {
        take_way();
        if (silent_ || skewed_) return;  // the account is late then, and may be
        if (truth_.may_run(last_now_)) break_rule("throttled with budget left");
        if (until > truth_.tokens().front()) break_rule("throttled beyond the replenishment");
        if (locks_ > 0 && ran_since_overrun_ + dawdled_ < shape_.budget) break_rule("throttled with a lock");
    }
    void break_rule(const std::string& how) {
        if (broken_.empty()) broken_ = how + " at " + std::to_string(now_);
    }

    KeptShape shape_;
    Ways& ways_;
    int delays_ = 0;
    std::int64_t now_ = 0, cpu_ = 0, switches_ = 0;
    std::optional<std::int64_t> due_;  // the timer
    bool in_handler_ = false;
    bool stepped_back_ = false;
    int locks_ = 0;

    std::int64_t last_now_ = 0;  // that the account was told
    bool entering_wait_ = false, in_way_ = false;
    std::optional<std::int64_t> woke_at_;
    std::int64_t wait_was_due_ = 0;  // its end
    std::int64_t way_ = 0;           // ticks of the way through the present wait
    std::int64_t forgiven_ = 0;      // of ways, counted by admission
    bool slept_for_budget_ = false;
    std::int64_t cpu_read_ = 0;  // what the account read last
    std::int64_t dawdled_ = 0;
    bool skewed_ = false;                 // a tick passed between two clocks
    bool silent_ = false;                 // a wait was not announced
    std::int64_t ran_since_overrun_ = 0;  // while it holds a lock
    std::deque<std::int64_t> lent_;       // tokens that were spent before they were due
    std::string broken_;

    ShellOf<KeptThread> shell_;
    oracle::TokenServer truth_;
    oracle::WaitBucket bucket_{shape_.period};
};

}  // namespace qduino::sched
