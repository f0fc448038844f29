// Chains in the simulator: what a run sees of one, beside the bound of admission.
#include <random>

#include "arduino/core/chain.h"
#include "arduino/core/channels.h"
#include "arduino/core/constants.h"
#include "arduino/core/interrupts.h"
#include "arduino/core/releases.h"
#include "tests/scenario/guarantee/sketch_bench.h"

namespace qduino::guarantee::chain_test {
namespace {

/// A button on pin 2, pressed or let go every 7 ms.
class Button final : public board::NoPeripherals {
  public:
    bool report_edges_to(board::PinEdgeSink& sink) override {
        sink_ = &sink;
        return true;
    }
    Instant next_event(Instant) override { return next_; }
    void advance(Instant now) override {
        if (now < next_) return;
        next_ += 7ms;
        down_ = !down_;
        sink_->pin_edge(now, board::PinId{2}, pin_level(now, board::PinId{2}));
    }
    board::Level pin_level(Instant, board::PinId pin) override {
        return pin.number == 2 && down_ ? board::Level::high : board::Level::low;
    }

  private:
    board::PinEdgeSink* sink_ = nullptr;
    Instant next_ = at(7ms);
    bool down_ = false;
};

class Chains : public ::testing::Test {
  protected:
    /// Each release of it computes for as long as `length` says.
    void add_loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core,
                  std::function<Nanoseconds()> length) {
        sketch_.add_loop(id, budget, period, core, [this, length = std::move(length)] {
            sketch_.board().compute(length());
            waitForNextPeriod();
        });
    }
    void add_loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core) {
        add_loop(id, budget, period, core, [budget] { return budget; });
    }
    /// Loop 2 asks for twenty times as much for the network's interrupts, and notes the answer.
    void add_loops_that_ask() {
        using qduino::arduino::TimeUnit;
        sketch_.set_setup([] { interruptsVcpu(TimeUnit::ms, board::DeviceClass::nic, 1, 100, 0); });
        add_loop(1, 1ms, 5ms, 0);
        add_loop(2, 2ms, 10ms, 0, [this] {
            granted_ = interruptsVcpu(TimeUnit::ms, board::DeviceClass::nic, 20, 100, 0);
            return 1ms;
        });
    }
    [[nodiscard]] const sched::ChainBound& bound() { return sketch_.runtime().plan().chains().front().bound; }
    [[nodiscard]] const runtime::ChainWatch& seen() { return *sketch_.runtime().chain_watch(0); }

    Button button_;
    SketchBench sketch_{button_};
    bool granted_ = false;
};

TEST_F(Chains, OneLoopTakesItsWholeBound) {
    ::Chain chain{"one"};
    chain.from(2).through(1).to(9).reactsWithin(15ms).freshWithin(5ms);
    add_loop(1, 5ms, 10ms, 0);
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(1s);
    EXPECT_EQ(bound().reaction, 15ms);
    EXPECT_EQ(seen().reaction(), 15ms);
    EXPECT_EQ(bound().age, 5ms);
    EXPECT_EQ(seen().age(), 5ms);
    EXPECT_GE(seen().count(), 98);
}

TEST_F(Chains, UpwardsTheLowerLoopsResponseCounts) {
    ::Chain chain{"up"};
    chain.from(2).through(2).through(1).to(9);
    add_loop(1, 2ms, 10ms, 0);
    add_loop(2, 9ms, 40ms, 0);
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(2s);
    // Loop 2 reads at 2 and ends at 13 ms. Loop 1 passes it on from 20 to 22, and last from 50 to
    // 52, when loop 2 is at work on the next.
    EXPECT_EQ(seen().age(), 50ms);
    EXPECT_EQ(seen().reaction(), 60ms);
    EXPECT_LE(seen().age(), bound().age);
    EXPECT_LE(seen().reaction(), bound().reaction);
}

TEST_F(Chains, ARingAndAnotherCoreStayWithinTheBound) {
    RingBuffer<int, 8> samples;
    ::Chain chain{"over a ring"};
    chain.from(2).through(1).over(samples).through(2).through(3).to(9);
    std::mt19937 random(1);
    const auto up_to = [&random](Nanoseconds most) {
        return [&random, most] { return std::uniform_int_distribution<int>(1, 8)(random) * most / 8; };
    };
    add_loop(1, 1ms, 5ms, 0, up_to(1ms));
    add_loop(2, 9ms, 30ms, 1, up_to(9ms));
    add_loop(3, 4ms, 20ms, 0, up_to(4ms));
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(5s);
    EXPECT_GE(seen().count(), 150);
    EXPECT_LE(seen().reaction(), bound().reaction);
    EXPECT_LE(seen().age(), bound().age);
    EXPECT_GT(seen().age(), bound().age / 2);
}

TEST_F(Chains, AChangeThatBreaksALimitIsRefusedWhileTheLoopsRun) {
    ::Chain chain{"tight"};
    chain.from(2).through(2).to(9).reactsWithin(14500us);
    granted_ = true;
    add_loops_that_ask();
    ASSERT_TRUE(sketch_.begin());
    const Nanoseconds before = bound().reaction;
    sketch_.run(50ms);
    EXPECT_FALSE(granted_) << "every loop would be admitted, and R of loop 2 would be longer";
    EXPECT_EQ(bound().reaction, before);
    EXPECT_LE(before, 14500us);
}

TEST_F(Chains, AChangeThatIsGrantedGivesItAnotherBound) {
    ::Chain chain{"wide"};
    chain.from(2).through(2).to(9).reactsWithin(40ms);
    add_loops_that_ask();
    ASSERT_TRUE(sketch_.begin());
    const Nanoseconds before = bound().reaction;
    EXPECT_EQ(seen().reaction_bound(), before);
    sketch_.run(50ms);
    ASSERT_TRUE(granted_);
    EXPECT_GT(bound().reaction, before);
    EXPECT_EQ(seen().reaction_bound(), bound().reaction) << "what the page shows";
    EXPECT_EQ(seen().age_bound(), bound().age);
}

TEST_F(Chains, AnEdgeIsFollowedToTheOutput) {
    ::Chain chain{"edge"};
    chain.fromEdge(2).through(1).to(9);
    static SketchBench* sketch = nullptr;
    sketch = &sketch_;
    sketch_.set_setup([] {
        attachInterruptVcpu(
            qduino::arduino::TimeUnit::ms, 2, [] { sketch->board().compute(100us); }, CHANGE, 1, 10, 0);
    });
    add_loop(1, 2ms, 10ms, 0);
    ASSERT_TRUE(sketch_.begin());
    sketch_.run(1s);
    EXPECT_GE(seen().count(), 90);
    EXPECT_LE(seen().reaction(), bound().reaction);
    EXPECT_GT(seen().reaction(), 10ms) << "an edge just behind the begin of loop 1";
    EXPECT_FALSE(bound().has_age);
}

}  // namespace
}  // namespace qduino::guarantee::chain_test
