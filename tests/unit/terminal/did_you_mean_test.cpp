#include "terminal/did_you_mean.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace qduino::apps::did_you_mean_test {
namespace {

/// As it is defined, without a table.
int naive(std::string_view a, std::string_view b) {
    if (a.empty() || b.empty()) return static_cast<int>(a.size() + b.size());
    const std::string_view a1 = a.substr(1), b1 = b.substr(1);
    int least = std::min({naive(a1, b) + 1, naive(a, b1) + 1, naive(a1, b1) + (a[0] == b[0] ? 0 : 1)});
    const bool swapped = a.size() > 1 && b.size() > 1 && a[0] == b[1] && a[1] == b[0];
    if (swapped) least = std::min(least, naive(a.substr(2), b.substr(2)) + 1);
    return least;
}

TEST(DidYouMean, TheDistanceIsTheDefinitions) {
    const auto seed = static_cast<unsigned>(std::random_device{}());
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random{seed};
    const auto word = [&] {
        std::string text(random() % 6, 'a');
        for (char& c : text) c = static_cast<char>('a' + random() % 3);
        return text;
    };
    for (int i = 0; i < 300; ++i) {
        const std::string a = word(), b = word();
        ASSERT_EQ(edit_distance(a, b), naive(a, b)) << a << " " << b;
    }
}

TEST(DidYouMean, TheNearestIsNamedAndNothingFarOff) {
    const std::vector<std::string> known{"new",   "build",  "run",     "sim",       "check",
                                         "trace", "doctor", "restore", "completion"};
    EXPECT_EQ(nearest("bulid", known), "build");
    EXPECT_EQ(nearest("chek", known), "check");
    EXPECT_EQ(nearest("rnu", known), "run");
    EXPECT_EQ(nearest("docter", known), "doctor");
    EXPECT_EQ(nearest("comp", known), "completion");
    EXPECT_EQ(nearest("r", known), "");
    EXPECT_EQ(nearest("print", known), "");
    EXPECT_EQ(nearest("", known), "");
    EXPECT_EQ(nearest("re", std::vector<std::string>{"release", "restore"}), "") << "either could be meant";
}

}  // namespace
}  // namespace qduino::apps::did_you_mean_test
