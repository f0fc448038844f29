// Bytes that wait for a reader who may be slow: what comes out are whole lines of what went in, in
// order, and a sign wherever one is missing.
#include "serial/held_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

namespace qduino::apps::held_lines_test {
namespace {

std::string take(HeldLines& held, std::size_t count) {
    count = std::min(count, held.size());
    std::string taken(held.bytes().data(), count);
    held.take(count);
    return taken;
}

/// A host that never waits, pieces of any length, a reader of any speed.
class Flood : public testing::TestWithParam<unsigned> {};

TEST_P(Flood, NoLineIsJoinedCutUnseenDoubledOrOutOfOrder) {
    std::mt19937 random{GetParam()};
    std::string sent;
    for (int i = 0; i < 20'000; ++i)
        sent += std::to_string(i) + std::string(random() % 30, 'x') + (random() % 5 == 0 ? "\r\n" : "\n");
    HeldLines held;
    std::string read;
    const std::size_t slowness = 1 + random() % 6;
    for (std::size_t at = 0; at < sent.size();) {
        const std::size_t piece = std::min<std::size_t>(1 + random() % 900, sent.size() - at);
        held.append({sent.data() + at, piece});
        at += piece;
        ASSERT_LE(held.size(), HeldLines::kMax);
        read += take(held, random() % 900 / slowness);
    }
    read += take(held, held.size());
    const auto lines_of = [](const std::string& text) {
        std::vector<std::string> lines(1);
        for (const char c : text) {
            if (c == '\n') {
                lines.emplace_back();
            } else {
                lines.back().push_back(c);
            }
        }
        return lines;
    };
    const std::vector<std::string> all = lines_of(sent);
    std::size_t next = 0, gaps = 0;
    bool gap = false;
    for (const std::string& line : lines_of(read)) {
        if (line.empty() || line == "\r") continue;
        if (line.back() == HeldLines::kGap) {
            gap = true;
            ++gaps;
            continue;
        }
        if (gap)
            next = static_cast<std::size_t>(
                std::find(all.begin() + static_cast<long>(next), all.end(), line) - all.begin());
        ASSERT_LT(next, all.size()) << "seed " << GetParam() << ": this line was never sent: " << line;
        ASSERT_EQ(line, all[next]) << "seed " << GetParam();
        ++next;
        gap = false;
    }
    EXPECT_TRUE(gap || next + 1 == all.size())
        << "seed " << GetParam() << ": what is missing at the end is not told";
    if (slowness > 2) {
        EXPECT_GT(gaps, 0u);
    }
    EXPECT_LT(gaps, sent.size() / (HeldLines::kMax / 4)) << "a gap is as long as half of the room";
}
INSTANTIATE_TEST_SUITE_P(Seeds, Flood, testing::Range(0u, 12u));

TEST(HeldLines, WhatIsDroppedIsDroppedToTheEndOfItsLine) {
    HeldLines held;
    held.append(std::string("G1 X1\nG1 X2"));
    held.drop();
    held.append(std::string("0 Y5\nG28\n"));
    EXPECT_EQ(take(held, held.size()), "G28\n");
    held.append(std::string("M10"));
    held.begin();
    held.append(std::string("M105\n"));
    EXPECT_EQ(take(held, held.size()), "M105\n");
}

}  // namespace
}  // namespace qduino::apps::held_lines_test
