#include "board/linux/computer/delay_witness.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "fake_machine.h"

namespace qduino::board::linux::delay_witness_test {
namespace {

using test::FakeMachine;

constexpr const char* kColumns = "      CPU0 CPU1\n";

/// What the kernel of a computer with two cores tells; `ticks` of 10 ms are the host's on core 1,
/// `soft` are soft interrupts'.
void tell(FakeMachine& machine, int ticks, int disk, int timer, int soft = 7) {
    machine.put("/proc/stat", text<std::string>("cpu 1 2 3 4 5 6 7 99 0 0\ncpu0 1 2 3 4 5 6 7 50 0 0\ncpu1 1 "
                                                "2 3 4 5 6 ",
                                                soft, ' ', ticks, " 0 0\nintr 5\n"));
    machine.put("/proc/interrupts",
                text<std::string>(kColumns, " 36: 900 ", disk, " PCI-MSI 0-edge virtio1-req.0\nLOC: 800 ",
                                  timer, " Local timer interrupts\nERR: 0\n"));
}

class DelayWitnessTest : public ::testing::Test {
  protected:
    DelayWitnessTest() {
        tell(machine_, 7, 100, 200);
        witness_.begin(kEpoch, wards_);
    }
    void late(Nanoseconds worst) { wards_[0].worst = worst; }
    /// A release of a loop that shares its core ended so late.
    void overrun(Nanoseconds lateness) {
        wards_[0].owns_core = false;
        ++wards_[0].late;
        wards_[0].worst_lately = lateness;
        wards_[0].worst = std::max(wards_[0].worst, lateness);
    }
    void look(Nanoseconds after_begin, Nanoseconds stood_still = 0ns) {
        witness_.look(kEpoch + after_begin, wards_, stood_still);
    }
    [[nodiscard]] GuaranteeReport report() const {
        GuaranteeReport report;
        witness_.describe(report);
        return report;
    }

    FakeMachine machine_;
    DelayWitness witness_{machine_.root()};
    std::vector<DelayWitness::Ward> wards_{{2, 1, true, ::getpid(), {}}};
};

TEST_F(DelayWitnessTest, WhatTookTheCoreInTheSecondOfTheWorstDelayIsNoted) {
    tell(machine_, 9, 150, 300);
    look(1s);
    EXPECT_EQ(report().delays.size(), 0u) << "nobody was late";
    late(49ms);
    tell(machine_, 14, 153, 560);
    look(3s);
    ASSERT_EQ(report().delays.size(), 1u);
    const DelayGuarantee found = report().delays[0];
    EXPECT_EQ(found.id, 2);
    EXPECT_EQ(found.core, 1);
    EXPECT_TRUE(found.owns_core);
    EXPECT_EQ(found.worst, 49ms);
    EXPECT_EQ(found.at, 3s);
    EXPECT_EQ(found.window, 2s);
    EXPECT_EQ(found.host, 50ms);
    EXPECT_EQ(found.interrupts, 3 + 260);
    EXPECT_EQ(found.most.view(), "LOC");
    EXPECT_GE(found.tasks, 0ns) << "this test's own thread, of which the kernel tells";
}

TEST_F(DelayWitnessTest, WhatComesLaterIsNotTakenForIt) {
    late(49ms);
    look(1s);
    tell(machine_, 100, 9000, 9000);
    look(2s);
    EXPECT_EQ(report().delays[0].at, 1s);
    EXPECT_EQ(report().delays[0].host, 0ns);
    EXPECT_EQ(report().delays[0].interrupts, 0);
}

TEST_F(DelayWitnessTest, AKernelThatDoesNotTellIsNotTakenForZero) {
    machine_.put("/proc/stat", "cpu 1 2 3");
    machine_.put("/proc/interrupts", "");
    late(1ms);
    look(1s);
    EXPECT_LT(report().delays[0].host, 0ns);
    EXPECT_LT(report().delays[0].interrupts, 0);
}

TEST_F(DelayWitnessTest, EachLateReleaseIsCountedUnderTheCauseOfItsSecond) {
    wards_[0].owns_core = false;
    wards_[0].tid = 0;  // this test's own thread may wait for a core for 10 ms as well
    wards_[0].throttled = 0;
    DelayWitness witness{machine_.root()};
    witness.begin(kEpoch, wards_);
    const auto look = [&](int second) {
        witness.look(kEpoch + second * 1s, wards_);
        wards_[0].worst_lately = Nanoseconds{0};
    };
    overrun(40ms);
    overrun(90ms);
    tell(machine_, 7 + 6, 100, 200);  // 60 ms of the host's
    look(1);
    overrun(20ms);
    tell(machine_, 13, 100, 200, 7 + 1);  // 10 ms of interrupts
    look(2);
    overrun(30ms);
    wards_[0].throttled = 2;
    look(3);
    overrun(30ms);
    wards_[0].throttled = 3;
    wards_[0].beyond = 4ms;
    look(4);
    look(5);
    GuaranteeReport report;
    witness.describe(report);
    ASSERT_EQ(report.delays.size(), 1u);
    const auto late = [&](DelayCause cause) {
        return report.delays[0].late[static_cast<std::size_t>(cause)];
    };
    EXPECT_EQ(late(DelayCause::host), 2);
    EXPECT_EQ(late(DelayCause::interrupts), 1);
    EXPECT_EQ(late(DelayCause::work), 1);
    EXPECT_EQ(late(DelayCause::charged), 1);
    EXPECT_EQ(report.delays[0].worst, 90ms);
    EXPECT_EQ(report.delays[0].host, 60ms) << "the evidence is that of the worst";
    EXPECT_EQ(witness.taken_of(1), 70ms);
}

TEST_F(DelayWitnessTest, AProgramThatStoodStillIsNoOnesFault) {
    overrun(300ms);
    look(1s, 0ns);
    ASSERT_EQ(report().delays.size(), 1u);
    EXPECT_NE(cause_of(report().delays[0]), DelayCause::stopped);
    overrun(1990ms);
    look(4s, 2s);
    EXPECT_EQ(report().delays[0].stopped, 2s);
    EXPECT_EQ(cause_of(report().delays[0]), DelayCause::stopped);
    EXPECT_EQ(report().delays[0].late[static_cast<std::size_t>(DelayCause::stopped)], 1);
}

TEST_F(DelayWitnessTest, AQuotaKeepsOrdinaryTasksWaitingAndNoOthers) {
    const auto throttled = [&](const char* ns) {
        machine_.put("/sys/fs/cgroup/cpu/cpu.stat", text<std::string>("nr_throttled 1\nthrottled_time ", ns));
    };
    machine_.put("/proc/self/cgroup", "3:cpu:/");
    machine_.put("/proc/self/mountinfo", "32 25 0:28 / /sys/fs/cgroup/cpu rw - cgroup cgroup rw,cpu");
    machine_.put("/sys/fs/cgroup/cpu/cpu.cfs_quota_us", "10000");
    throttled("0");
    look(1s);
    overrun(90ms);
    throttled("800000000");
    look(2s, 850ms);
    EXPECT_EQ(report().delays[0].quota, 0ns) << "a real-time thread has no quota";
    wards_[0].ordinary = true;
    overrun(95ms);
    throttled("1600000000");
    look(3s, 850ms);
    EXPECT_EQ(report().delays[0].quota, 800ms);
    EXPECT_EQ(report().delays[0].stopped, 50ms) << "what waits for a quota stands still, too";
    EXPECT_EQ(cause_of(report().delays[0]), DelayCause::quota);
}

}  // namespace
}  // namespace qduino::board::linux::delay_witness_test
