#include "sched/explain.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "tests/unit/sched/make.h"

namespace qduino::sched::explain_test {
namespace {

std::string text_of(const Explanation& explanation) { return std::string{explanation.view()}; }

std::size_t longest_line(const std::string& text) {
    std::size_t longest = 0;
    for (std::size_t from = 0; from < text.size();) {
        const std::size_t end = text.find('\n', from);
        longest = std::max(longest, end - from);
        from = end + 1;
    }
    return longest;
}

TEST(Explain, AnAdmittedCore) {
    const CoreLoad load = load_of({loop_of(1, 30ms, 100ms), loop_of(2, 20ms, 100ms), loop_of(3, 4ms, 10ms)});
    EXPECT_EQ(text_of(explain(admit(load))),
              "core 0: admitted, utilisation 0.9000: even at worst, each ends in time (R <= T)\n"
              "  loop 3   R 4 ms of T 10 ms\n"
              "  loop 1   R 50 ms of T 100 ms\n"
              "  loop 2   R 86 ms of T 100 ms\n");
}

TEST(Explain, ARefusalSaysWhoWhyAndWhatWouldHelp) {
    const CoreLoad load = load_of({loop_of(1, 30ms, 100ms), loop_of(2, 20ms, 100ms), loop_of(3, 4ms, 10ms),
                                   loop_of(4, 10001us, 100ms)});
    EXPECT_EQ(text_of(explain(admit(load).refusal, 0)),
              "loop 4 (10.001 ms in 100 ms) is refused on core 0:\n"
              "  R = 186.001 ms > T = 100 ms\n"
              "  who takes its 100 ms, at worst:\n"
              "    loop 4 itself                      10.001 ms\n"
              "    loop 3                                 40 ms\n"
              "    loop 1                                 30 ms\n"
              "    loop 2                                 20 ms\n"
              "    together                          100.001 ms\n"
              "  smallest change that would be admitted, each alone:\n"
              "    budget 10 ms (1 us less)\n"
              "    period 186.001 ms (86.001 ms more)\n");
}

TEST(Explain, ABottomHalfThatGetsTooLittle) {
    EXPECT_EQ(text_of(explain(admit(load_of({loop_of(1, 8ms, 10ms), io_of(33, 30ms, 100ms)})).refusal, 0)),
              "I/O VCPU 33 (30 ms in 100 ms) is refused on core 0:\n"
              "  I/O VCPU 33 would be served late for a loop of its core:\n"
              "  R = 19 ms > T = 10 ms\n"
              "  who takes its 10 ms, at worst:\n"
              "    I/O VCPU 33                             3 ms\n"
              "    loop 1                                  8 ms\n"
              "    together                               11 ms\n"
              "  smallest change that would be admitted, each alone:\n"
              "    budget 20 ms (10 ms less)\n"
              "    period 150 ms (50 ms more)\n");
}

TEST(Explain, ARefusalSaysHowBurstsWereCounted) {
    CoreLoad load = load_of({loop_of(1, 1ms, 2ms)});
    load.overheads.interferers.push_back({.name = FixedString<23>{"interrupts"},
                                          .cost = 10us,
                                          .interval = 200us,
                                          .jitter = 19ms,
                                          .peak_interval = 80us,
                                          .peak_jitter = 12ms});
    const std::string text = text_of(explain(admit(load).refusal, 0));
    EXPECT_NE(text.find("    interrupts                           1.05 ms\n"), std::string::npos) << text;
    // 96 of 10 us, by the first pair: 12 ms/80 us are 151, by the second.
    EXPECT_NE(text.find("  (interrupts: counted as up to 960 us at once, and 0.0500 of the core)\n"),
              std::string::npos)
        << text;
    EXPECT_LE(longest_line(text), 80u) << text;
}

TEST(Explain, AnOwnedCore) {
    const CoreLoad load = load_of({loop_of(2, 100us, 100us, 1), loop_of(5, 1us, 100ms, 1)});
    EXPECT_EQ(text_of(explain(admit(load))),
              "core 0: refused\n"
              "loop 5 (1 us in 100 ms) is refused on core 0:\n"
              "  loop 2 owns that core (its budget is its period)\n"
              "  no change to this one alone would be admitted\n");
}

TEST(Explain, AnOwnedCoreIsNotHeldAgainstTheBound) {
    // With overheads a whole core is more than whole: "1.4430 <= bound 1.0000" stood here once.
    CoreLoad load = load_of({loop_of(2, 100us, 100us, 1)});
    load.core = 1;
    load.overheads.release_cost = 44300ns;
    const Admission admission = admit(load);
    ASSERT_GT(admission.utilisation_ppm, admission.bound_ppm);
    EXPECT_EQ(text_of(explain(admission)),
              "core 1: admitted, owned by loop 2: it is alone there and never throttled\n"
              "  loop 2   R 100 us of T 100 us\n");
}

TEST(Explain, AWholeMachine) {
    const std::vector<Vcpu> requests{loop_of(1, 9ms, 10ms, 0), loop_of(2, 5ms, 10ms, 1),
                                     loop_of(3, 6ms, 10ms, kAnyCore)};
    const std::vector<PlatformOverheads> overheads(2);
    const auto machine = std::make_unique<MulticoreAdmission>();
    admit_all(requests, overheads, {}, *machine);
    EXPECT_EQ(text_of(explain(*machine)),
              "core 0: admitted, utilisation 0.9000 <= bound 1.0000\n"
              "  loop 1   R 9 ms of T 10 ms\n"
              "core 1: admitted, utilisation 0.5000 <= bound 1.0000\n"
              "  loop 2   R 5 ms of T 10 ms\n"
              "loop 3 (6 ms in 10 ms) is refused by every core; nearest is core 1:\n"
              "  R = 16 ms > T = 10 ms\n"
              "  who takes its 10 ms, at worst:\n"
              "    loop 3 itself                           6 ms\n"
              "    loop 2                                  5 ms\n"
              "    together                               11 ms\n"
              "  smallest change that would be admitted, each alone:\n"
              "    budget 5 ms (1 ms less)\n"
              "    period 16 ms (6 ms more)\n");
}

TEST(Explain, TheFullestCoreFitsItsLinesAndItsBuffer) {
    CoreLoad load;
    for (int i = 1; i <= 32; ++i)
        ASSERT_TRUE(load.try_add(loop_of(static_cast<VcpuId>(i), 1000001ns, 64000001ns)));
    for (int i = 33; i <= 63; ++i) ASSERT_TRUE(load.try_add(io_of(static_cast<VcpuId>(i), 1001ns, 40001ns)));
    load.overheads.release_cost = 12345ns;
    for (int i = 0; i < 8; ++i) {
        load.overheads.interferers.push_back({"irq/123-a-long-name-eth", 12345ns, 1000001ns, 7ns});
    }
    const std::string text = text_of(explain(admit(load)));
    EXPECT_NE(text.find("is refused on core 0"), std::string::npos);
    EXPECT_NE(text.find("no change to this one alone"), std::string::npos) << text;
    EXPECT_EQ(text.back(), '\n');
    EXPECT_LE(longest_line(text), 80u) << text;
}

}  // namespace
}  // namespace qduino::sched::explain_test
