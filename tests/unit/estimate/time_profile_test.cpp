// The table of times: it holds what it was told, whatever the length of the job.
#include "printer/estimate/time_profile.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace qduino::printer::estimate::time_profile_test {
namespace {

TEST(TimeProfile, SaysWhatWasDoneAtEachStep) {
    TimeProfile profile;
    profile.add(0.4, 100);
    profile.add(2.5, 200);  // a long move: it is done at 2.5 s alone
    profile.add(3.0, 300);
    ASSERT_EQ(profile.bytes().size(), 3u);
    EXPECT_EQ(profile.step_s(), 1);
    EXPECT_EQ(profile.bytes()[0], 100u);
    EXPECT_EQ(profile.bytes()[1], 100u);
    EXPECT_EQ(profile.bytes()[2], 200u);
}

TEST(TimeProfile, StaysSmallAndRightHoweverLongTheJobIs) {
    for (unsigned seed = 1; seed <= 30; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 random{seed};
        std::exponential_distribution<> pause{seed % 3 == 0 ? 0.01 : 10};
        TimeProfile profile;
        std::map<double, std::uint64_t> done;
        double time_s = 0;
        for (std::uint64_t byte = 30; byte < 30'000; byte += 30) {
            time_s += pause(random);
            profile.add(time_s, byte);
            done[time_s] = byte;
        }
        ASSERT_LE(profile.bytes().size(), TimeProfile::kPointsMax);
        EXPECT_GE(static_cast<double>(profile.bytes().size() + 1) * profile.step_s(), time_s);
        for (std::size_t i = 0; i < profile.bytes().size(); ++i) {
            const auto after = done.lower_bound(static_cast<double>(i + 1) * profile.step_s());
            const std::uint64_t byte = after == done.begin() ? 0 : std::prev(after)->second;
            EXPECT_EQ(profile.bytes()[i], byte) << i;
        }
    }
}

TEST(TimeProfile, ADayInOneStepIsBounded) {
    TimeProfile profile;
    for (int day = 1; day <= 400; ++day) profile.add(86400.0 * day, static_cast<std::uint64_t>(day));
    EXPECT_LE(profile.bytes().size(), TimeProfile::kPointsMax);
    EXPECT_GT(profile.bytes().size(), TimeProfile::kPointsMax / 2 - 1);
}

}  // namespace
}  // namespace qduino::printer::estimate::time_profile_test
