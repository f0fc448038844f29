// A loop whose core is another task's does not end when it is asked to. The report says so, and the
// sketch ends with words: what the loop uses may not be destroyed while it may still run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <optional>
#include <string>

#include "board/linux/kernel/real_time_thread.h"
#include "tests/unit/linux/foreign_spinner.h"

namespace qduino::board::linux::test::starved_test {
namespace {

using ::testing::ContainsRegex;
using ::testing::HasSubstr;
using ::testing::Not;

/// Ends the sketch by force after 30 s.
constexpr const char* kCommand = "timeout -s KILL 30 " STARVED_SKETCH " --for 1 2>&1";

TEST(AStarvedLoop, IsNamedAndTheSketchEndsWithWords) {
    if (cpu_count() < 2) GTEST_SKIP() << "needs two cores";
    std::FILE* const output = ::popen(kCommand, "re");
    ASSERT_NE(output, nullptr);
    std::optional<ForeignSpinner> spinner;
    std::string said;
    for (std::array<char, 512> line{}; std::fgets(line.data(), line.size(), output);) {
        said += line.data();
        // Admission is over. The spinner has the rank of loop 2, which sleeps now and then.
        if (!spinner && said.find("What holds on this board") != std::string::npos)
            spinner.emplace(1, 80, 12s);
    }
    const int status = ::pclose(output);
    SCOPED_TRACE(said);
    if (!spinner || !spinner->spins()) GTEST_SKIP() << "refused, or no right to real-time priorities";
    ASSERT_TRUE(WIFEXITED(status)) << "of signal " << WTERMSIG(status);
    // The kernel's throttling lets it end now and then.
    if (said.find("the sketch is ended as it is") == std::string::npos) {
        EXPECT_THAT(said, Not(HasSubstr("Periods: every period was kept")));
        return;
    }
    EXPECT_EQ(WEXITSTATUS(status), 1);
    EXPECT_THAT(said, ContainsRegex("loop 2 (never ran|has not ended); the sketch is ended as it is"));
}

}  // namespace
}  // namespace qduino::board::linux::test::starved_test
