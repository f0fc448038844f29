#include "apps/printer_sim/board_costs.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "twin/printer.h"

namespace qduino::apps::board_costs_test {
namespace {

using board::Level;
using board::PinId;
using board::sim::ApiCall;
using board::sim::SimBoard;
using board::sim::SimConfig;
using ::testing::HasSubstr;

/// On core 1: three writes and a reading of the clock every millisecond.
void write_three(void* context) {
    SimBoard& board = *static_cast<SimBoard*>(context);
    Instant due = board.now();
    while (!board.stop_requested()) {
        for (int i = 0; i < 3; ++i) board.pin_write(PinId{4}, i % 2 == 0 ? Level::high : Level::low);
        board.busy_until(due += 1ms);
    }
}

/// On core 0: sleeps to each tenth millisecond.
void sleep_often(void* context) {
    SimBoard& board = *static_cast<SimBoard*>(context);
    for (Instant due = board.now(); !board.stop_requested();) board.sleep_until(due += 10ms);
}

class BusyRun {
  public:
    explicit BusyRun(const SimConfig& config) : twin_(twin::Machine{}), board_(config, twin_) {
        std::array<board::VcpuSpec, 2> specs{board::VcpuSpec{{1, 1ms, 10ms, 0}},
                                             board::VcpuSpec{{2, 100us, 100us, 1}}};
        specs[0].entry = &sleep_often;
        specs[1].entry = &write_three;
        specs[1].owns_core = true;
        for (board::VcpuSpec& spec : specs) spec.context = &board_;
        EXPECT_TRUE(board_.pin_mode(PinId{4}, board::PinMode::output));
        EXPECT_TRUE(board_.start(specs));
        board_.run(kEpoch + 1s);
        costs = board_costs("a.toml", config, board_, 1, 100);
        board_.request_stop();
        board_.run(kEpoch + 2s);
    }
    [[nodiscard]] const board::sim::Tally& of(std::string_view what, std::size_t core) const {
        const auto row = std::ranges::find(costs.rows, what, &BoardCosts::Row::what);
        EXPECT_NE(row, costs.rows.end()) << what;
        return row->cores[core];
    }

  private:
    twin::Printer twin_;
    SimBoard board_;

  public:
    BoardCosts costs;
};

SimConfig busy_computer() {
    SimConfig config;
    config.costs[ApiCall::pin_write] = 100ns;
    config.costs[ApiCall::now] = 30ns;
    config.costs.context_switch = 2us;
    config.tick_period = 4ms;
    config.tick_cost = 3us;
    config.interrupts = {{.device = board::DeviceClass::nic,
                          .rate_hz = 500,
                          .arrival = board::sim::Arrival::periodic,
                          .core = 0,
                          .top_half = 5us,
                          .bottom_half = 7us}};
    return config;
}

TEST(BoardCosts, CallsAreCountedOnTheirCore) {
    const BusyRun run(SimConfig{});
    EXPECT_NEAR(static_cast<double>(run.of("pin writes", 1).count), 3000, 6);
    EXPECT_EQ(run.of("pin writes", 0).count, 0u);
    EXPECT_EQ(run.of("pin writes", 1).time, 0ns) << "the default computer's calls cost nothing";
    EXPECT_NEAR(static_cast<double>(run.of("sleeps", 0).count), 100, 2);
    EXPECT_NEAR(static_cast<double>(run.of("context switches", 0).count), 100, 2);
    EXPECT_EQ(run.of("ticks", 0).count, 0u);
    EXPECT_EQ(run.costs.busy.at(0), 0ns) << "it only sleeps";
    EXPECT_NEAR(to_seconds(run.costs.busy.at(1)), 1, 1e-3) << "its own core";
}

TEST(BoardCosts, TimeIsWhatTheBoardFileSays) {
    const BusyRun run(busy_computer());
    const auto& writes = run.of("pin writes", 1);
    EXPECT_EQ(writes.time, 100ns * static_cast<std::int64_t>(writes.count));
    EXPECT_NEAR(static_cast<double>(run.of("interrupts", 0).count), 500, 2);
    EXPECT_NEAR(to_seconds(run.of("interrupts", 0).time), 500 * 12e-6, 50e-6)
        << "with the bottom half: nobody serves it";
    EXPECT_NEAR(static_cast<double>(run.of("ticks", 1).count), 250, 2);
    EXPECT_NEAR(to_seconds(run.of("ticks", 1).time), 250 * 3e-6, 10e-6);
    EXPECT_NEAR(to_seconds(run.of("context switches", 0).time), 100 * 2e-6, 10e-6);
    // What 100 steps cost on core 1: the writes and the readings of the clock.
    const double clock_ns = static_cast<double>(run.of("clock readings", 1).time.count());
    EXPECT_NEAR(run.costs.ns_of_a_step(1), (static_cast<double>(writes.time.count()) + clock_ns) / 100, 1e-6);
}

TEST(BoardCosts, TheTableHasWhatThereWas) {
    const BusyRun run(busy_computer());
    const std::string shown = table(run.costs);
    EXPECT_THAT(shown, HasSubstr("pin writes"));
    EXPECT_THAT(shown, HasSubstr("core 1"));
    EXPECT_THAT(shown, HasSubstr("ns of core 1 for each step"));
    EXPECT_EQ(shown.find("locks"), std::string::npos) << "there were none";
    const nlohmann::ordered_json json = to_json(run.costs);
    EXPECT_EQ(json["cores"].size(), 2u);
    EXPECT_NEAR(json["cores"][1]["pin_writes"]["per_step"].get<double>(), 30, 0.1);
    EXPECT_NEAR(json["cores"][1]["pin_writes"]["share"].get<double>(), 3000 * 100e-9, 1e-6);
}

}  // namespace
}  // namespace qduino::apps::board_costs_test
