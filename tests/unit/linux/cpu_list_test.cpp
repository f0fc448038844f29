#include "board/linux/kernel/cpu_list.h"

#include <gtest/gtest.h>

#include <random>

namespace qduino::board::linux::cpu_list_test {
namespace {

TEST(CpuList, ReadsAndWritesTheKernelsLists) {
    for (const char* text : {"", "0", "0-3", "1,3,5-7", "0-1023"}) {
        const auto cpus = CpuList::from_list(std::string{text} + "\n");
        ASSERT_TRUE(cpus) << text;
        EXPECT_EQ(cpus->to_list(), text);
    }
    EXPECT_EQ(CpuList::from_list("0,1,2,3")->to_list(), "0-3");
}

TEST(CpuList, RefusesWhatIsNoList) {
    for (const char* text : {"a", "3-1", "1-", "-1", "1024", "0,,1", "(null)", "1 2"}) {
        EXPECT_FALSE(CpuList::from_list(text)) << text;
    }
}

TEST(CpuList, ReadsAndWritesTheKernelsMasks) {
    EXPECT_EQ(CpuList::from_mask("3\n")->to_list(), "0-1");
    EXPECT_EQ(CpuList::from_mask("00000001,0000004f")->to_list(), "0-3,6,32");
    EXPECT_EQ(CpuList::from_list("0-3,6,32")->to_mask(64), "1,0000004f");
    EXPECT_EQ(CpuList::from_list("1")->to_mask(2), "2");
    EXPECT_EQ(CpuList{}.to_mask(40), "0,00000000");
    EXPECT_FALSE(CpuList::from_mask("xyz"));
    EXPECT_FALSE(CpuList::from_mask("1ffffffff"));
}

TEST(CpuList, AnySetSurvivesBothWritings) {
    std::mt19937_64 random{42};
    for (int round = 0; round < 200; ++round) {
        const int cpus = 1 + static_cast<int>(random() % 256);
        CpuList set;
        for (int cpu = 0; cpu < cpus; ++cpu) {
            if (random() % 3 == 0) set.add(cpu);
        }
        EXPECT_EQ(CpuList::from_list(set.to_list()), set);
        EXPECT_EQ(CpuList::from_mask(set.to_mask(cpus)), set);
        EXPECT_TRUE(set.without(set).empty());
        EXPECT_EQ(CpuList::first(cpus).without(set).size() + set.size(), cpus);
    }
}

}  // namespace
}  // namespace qduino::board::linux::cpu_list_test
