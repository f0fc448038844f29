// Parameters that one thread asks of another: whole, the latest, each once.
#include "board/linux/loop/parameters_mail.h"

#include <gtest/gtest.h>

#include <thread>

namespace qduino::board::linux::test::parameters_mail_test {
namespace {

TEST(ParametersMail, GivesTheLatestOnceToEachReader) {
    ParametersMail mail;
    std::uint32_t first = 0, second = 0;
    EXPECT_FALSE(mail.take(first));
    mail.put({1ms, 10ms});
    mail.put({2ms, 20ms});
    EXPECT_EQ(mail.take(first), (sched::VcpuParameters{2ms, 20ms}));
    EXPECT_FALSE(mail.take(first));
    EXPECT_EQ(mail.take(second), (sched::VcpuParameters{2ms, 20ms}));
}

TEST(ParametersMail, IsNeverReadInHalves) {
    constexpr std::int64_t kLast = 2'000'000;
    ParametersMail mail;
    std::thread writer{[&] {
        for (std::int64_t i = 1; i <= kLast; ++i) mail.put({Nanoseconds{i}, Nanoseconds{2 * i}});
    }};
    std::uint32_t seen = 0;
    for (std::int64_t last = 0; last < kLast;) {
        const auto taken = mail.take(seen);
        if (!taken) continue;
        if (taken->period != 2 * taken->budget || taken->budget.count() <= last) {
            ADD_FAILURE() << to_ns(taken->budget) << " of " << to_ns(taken->period) << " after " << last;
            break;
        }
        last = taken->budget.count();
    }
    writer.join();
}

}  // namespace
}  // namespace qduino::board::linux::test::parameters_mail_test
