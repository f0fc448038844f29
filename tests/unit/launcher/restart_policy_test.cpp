#include "apps/launcher/restart_policy.h"

#include <gtest/gtest.h>

namespace qduino::launcher::restart_policy_test {
namespace {

const Ended kKilledReady{.by_signal = true, .status = 9, .was_ready = true};
const Ended kKilledEarly{.by_signal = true, .status = 9, .was_ready = false};
const Ended kErrorEarly{.by_signal = false, .status = 1, .was_ready = false};
const Ended kErrorReady{.by_signal = false, .status = 1, .was_ready = true};
const Ended kWell{.by_signal = false, .status = 0, .was_ready = true};

TEST(RestartPolicy, WhatIsKilledIsStartedAgainForEverAndEverMoreSlowly) {
    RestartPolicy policy;
    Nanoseconds before{0};
    for (int i = 0; i < 100; ++i) {
        const auto pause = policy.on_end(i % 2 == 0 ? kKilledReady : kKilledEarly, 1s);
        ASSERT_TRUE(pause.has_value()) << i;
        EXPECT_GE(*pause, before);
        EXPECT_LE(*pause, RestartPolicy::kLastPause);
        before = *pause;
    }
    EXPECT_EQ(before, RestartPolicy::kLastPause);
}

TEST(RestartPolicy, AfterAGoodLifeThePausesBeginAtTheFirst) {
    RestartPolicy policy;
    for (int i = 0; i < 10; ++i) static_cast<void>(policy.on_end(kKilledReady, 1s));
    EXPECT_EQ(policy.on_end(kKilledReady, RestartPolicy::kGoodLife), RestartPolicy::kFirstPause);
}

TEST(RestartPolicy, WhatSaysAtTheFirstStartWhyItCannotIsGivenUp) {
    RestartPolicy policy;
    EXPECT_EQ(policy.on_end(kErrorEarly, 1s), std::nullopt);
}

TEST(RestartPolicy, AProcessThatWasKilledBeforeItWasReadyMayStillFailForGood) {
    RestartPolicy policy;
    EXPECT_TRUE(policy.on_end(kKilledEarly, 1s));
    EXPECT_FALSE(policy.on_end(kErrorEarly, 1s));
}

TEST(RestartPolicy, ErrorsAfterItOnceWasReadyAreGivenUpAtTheThirdInARow) {
    RestartPolicy policy;
    EXPECT_TRUE(policy.on_end(kKilledReady, 1s));
    EXPECT_TRUE(policy.on_end(kErrorEarly, 1s));
    EXPECT_TRUE(policy.on_end(kErrorEarly, 1s));
    EXPECT_TRUE(policy.on_end(kErrorReady, 1s)) << "it had come up between: they are not in a row";
    EXPECT_TRUE(policy.on_end(kErrorEarly, 1s));
    EXPECT_TRUE(policy.on_end(kErrorEarly, 1s));
    EXPECT_FALSE(policy.on_end(kErrorEarly, 1s));
}

TEST(RestartPolicy, ASupervisorWhoseSketchWasKilledHasNotFailedItself) {
    RestartPolicy policy;
    for (int i = 0; i < 10; ++i)
        EXPECT_TRUE(policy.on_end({.by_signal = false, .status = 137, .was_ready = false}, 1s));
}

TEST(RestartPolicy, WhatEndsWellWasAskedTo) {
    RestartPolicy policy;
    EXPECT_EQ(policy.on_end(kWell, 1s), std::nullopt);
}

}  // namespace
}  // namespace qduino::launcher::restart_policy_test
