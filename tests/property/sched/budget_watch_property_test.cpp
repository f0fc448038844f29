// A thread on a server is never held from outside: whatever work comes when, whatever preempts it,
// however late the watch hears of it, and though it overruns where a lock is held.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "sched/budget_watch.h"
#include "sched/sporadic_server.h"

namespace qduino::sched::budget_watch_property_test {
namespace {

/// A thread on a sporadic server, among others that preempt it.
class ServedThread {
  public:
    ServedThread(VcpuParameters vcpu, std::mt19937& random) : vcpu_(vcpu), server_(vcpu), random_(random) {}

    /// A stretch of at most `most`, in which it runs, waits, is throttled or preempted.
    void pass(Nanoseconds most) {
        Nanoseconds length{1 + below(to_ns(most))};
        const Nanoseconds own = works_ ? server_.available(now_) : Nanoseconds{0};
        if (chance(3) && waiting_ == Nanoseconds{0}) {
            change_work();
        } else if (own > Nanoseconds{0}) {
            if (others_ > Nanoseconds{0} && chance(3)) {
                length = std::min(length, others_);
                waiting_ += length;
                others_ -= length;
            } else {
                length = std::min(length, own + grace());
                now_ += length;
                used_ += length;
                delayed_ += waiting_;
                waiting_ = Nanoseconds{0};
                server_.consume(now_, length);
                if (server_.available(now_) <= Nanoseconds{0}) others_ = vcpu_.period - vcpu_.budget;
                return;
            }
        }
        now_ += length;
    }
    [[nodiscard]] Instant now() const { return now_; }
    [[nodiscard]] ThreadTimes times() const { return {used_, delayed_}; }

  private:
    std::int64_t below(std::int64_t limit) {
        return std::uniform_int_distribution{std::int64_t{0}, limit - 1}(random_);
    }
    bool chance(int one_in) { return below(one_in) == 0; }
    void change_work() {
        works_ = !works_;
        others_ = vcpu_.period - vcpu_.budget;
        works_ ? server_.unblock(now_) : server_.block(now_);
    }
    /// It holds a lock now and then.
    Nanoseconds grace() { return chance(4) ? std::min<Nanoseconds>(vcpu_.budget, 5ms) : Nanoseconds{0}; }

    VcpuParameters vcpu_;
    SporadicServer server_;
    std::mt19937& random_;
    Instant now_ = kEpoch;
    Nanoseconds used_{};
    Nanoseconds delayed_{};
    // In an admitted set, others keep it from its budget for so long at most.
    Nanoseconds others_{};
    Nanoseconds waiting_{};  // told as delay when it runs again
    bool works_ = false;
};

TEST(BudgetWatchProperty, AThreadOnAServerIsNeverHeld) {
    const unsigned seed = std::random_device{}();
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random{seed};
    const auto in = [&](int low, int high) { return std::uniform_int_distribution{low, high}(random); };
    for (int run = 0; run < 300; ++run) {
        const int period_us = in(200, 200'000);
        const VcpuParameters vcpu{std::chrono::microseconds{in(100, period_us)},
                                  std::chrono::microseconds{period_us}};
        ServedThread thread{vcpu, random};
        BudgetWatch watch{vcpu, 0ns, kEpoch, {}};
        Nanoseconds told{};
        for (int step = 0; step < 3000; ++step) {
            thread.pass(vcpu.period);
            if (thread.now() < watch.next_look()) continue;
            const Nanoseconds unseen = std::chrono::microseconds{in(0, 4000)};
            told = std::max(told, thread.times().cpu - unseen);
            ASSERT_EQ(watch.look(thread.now(), {told, thread.times().delayed}), BudgetWatch::Verdict::run)
                << period_us << " us, step " << step << ", budget " << to_ns(vcpu.budget);
        }
    }
}

}  // namespace
}  // namespace qduino::sched::budget_watch_property_test
