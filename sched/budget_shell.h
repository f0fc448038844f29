// The shell around a budget's account: it reads the clocks, carries out effects, and keeps the
// timer's handler and the thread's ordinary path out of each other's way.
//
// The handler interrupts the thread that the account is about, so no lock can part the two: the
// handler would wait for ever. Instead each call of the path marks the shell as busy. A timer that
// comes meanwhile is only noted, and the path takes it up when it is done. An announced wait is
// part of the path: the shell is busy from before_wait() to after_wait().
//
//   path      ──busy───────┐ not busy, missed? ──► busy again: timer()
//   handler        noted ──┘
//
// `Host` is the board's side, called from the path and from the handler:
//   BudgetReading read();  Nanoseconds cpu();         the clocks of the calling thread
//   void set_timer(const BudgetEffect&);              disarm, arm_in, arm_at
//   void sleep_until(Instant);                        of the calling thread; no signal ends it
//   void step_back(bool);                             it has the rank that it inherits alone
#pragma once

#include <atomic>

#include "base/time.h"
#include "sched/budget_account.h"

namespace qduino::sched {

/// Every call by the thread that is kept, on_timer() by its handler or by an interrupt on its core.
/// Tests put the rules of the account, written down once more, in the account's place.
template <typename Host, typename Account = BudgetAccount>
class BudgetShell {
  public:
    explicit BudgetShell(Host& host) : host_(host) {}

    /// Begins to keep the calling thread. `rest`: longer than the way into a sleep takes.
    void start(const Server& server, Nanoseconds rest = {}) {
        set_busy(true);
        const BudgetReading reading = host_.read();
        account_ = Account{server, reading, rest};
        leave(account_.timer(reading));
    }
    /// Around a wait of the thread that ends at `until`, or, kForever, nobody knows when. It ended
    /// at `now`.
    void before_wait(Instant until) {
        set_busy(true);
        carry_out(account_.blocks(host_.read(), until));
    }
    void after_wait(Instant now) { leave(account_.woke(now, host_.cpu())); }

    /// The thread, an I/O VCPU's, has another budget and period from now on.
    void change(VcpuParameters parameters) {
        set_busy(true);
        leave(account_.change(host_.read(), parameters));
    }
    /// The thread begins the release that was due at `nominal`.
    void begin_release(Instant nominal) {
        set_busy(true);
        account_.release(nominal);
        leave({});
    }

    /// What its sections under locks say (budget_account.h).
    void may_overrun(Nanoseconds longest) {
        set_busy(true);
        account_.may_overrun(longest);
        leave({});
    }
    /// Before the thread takes a lock, and after it has released it. Nests.
    void begin_hold() {
        set_busy(true);
        account_.holds();
        leave({});
    }
    void end_hold() {
        set_busy(true);
        leave(account_.releases() ? account_.timer(host_.read()) : BudgetEffect{});
    }

    /// The timer came. False: it was noted, for the path is at work on the account.
    bool on_timer() {
        if (busy_.load(std::memory_order_relaxed)) {
            missed_.store(true, std::memory_order_relaxed);
            return false;
        }
        set_busy(true);
        leave(account_.timer(host_.read()));
        return true;
    }

    [[nodiscard]] const Account& account() const { return account_; }

  private:
    void set_busy(bool busy) {
        std::atomic_signal_fence(std::memory_order_seq_cst);
        busy_.store(busy, std::memory_order_relaxed);
        std::atomic_signal_fence(std::memory_order_seq_cst);
    }
    void leave(const BudgetEffect& effect) {
        carry_out(effect);
        set_busy(false);
        while (missed_.load(std::memory_order_relaxed)) {
            set_busy(true);
            missed_.store(false, std::memory_order_relaxed);
            carry_out(account_.timer(host_.read()));
            set_busy(false);
        }
    }
    void carry_out(BudgetEffect effect) {
        while (effect.kind == BudgetEffect::Kind::sleep_until) {
            take_rank(effect);
            host_.sleep_until(effect.at);
            effect = account_.resumed(host_.read());
        }
        if (effect.kind == BudgetEffect::Kind::none) return;
        host_.set_timer(effect);
        take_rank(effect);
    }
    void take_rank(const BudgetEffect& effect) {
        if (effect.steps_back == stepped_back_) return;
        stepped_back_ = effect.steps_back;
        host_.step_back(stepped_back_);
    }

    Host& host_;
    Account account_;
    std::atomic<bool> busy_{false};    // the path, or the handler, works on the account
    std::atomic<bool> missed_{false};  // the timer came meanwhile
    bool stepped_back_ = false;
};

}  // namespace qduino::sched
