#include "printer/machine/job_receiver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>

namespace qduino::printer::machine::job_receiver_test {
namespace {

using Event = JobReceiver::Event;

struct Bench {
    std::unique_ptr<JobReceiver::Ring> ring = std::make_unique<JobReceiver::Ring>();
    JobReceiver receiver;
    std::string text;

    void begin(std::uint64_t id, std::uint64_t length) { push(link::encode(link::JobBegin{id, length})); }
    void bytes(std::uint64_t id, std::uint64_t offset, std::string_view content) {
        push(link::encode(link::JobBytes{
            id, offset, {reinterpret_cast<const std::uint8_t*>(content.data()), content.size()}}));
    }
    void end(std::uint64_t id) { push(link::encode(link::JobEnd{id})); }
    void push(const link::Frame& frame) { ASSERT_TRUE(link::try_push(*ring, frame)); }
    /// Everything that can be read, appended to `text`; the last event that was not bytes.
    Event read() {
        Event last = Event::none;
        for (Event event = receiver.receive(*ring); event != Event::none; event = receiver.receive(*ring)) {
            if (event != Event::bytes) last = event;
            text.append(receiver.held().begin(), receiver.held().end());
            receiver.use(receiver.held().size());
        }
        return last;
    }
};

TEST(JobReceiver, TakesAJobInOrder) {
    Bench bench;
    bench.begin(3, 10);
    bench.bytes(3, 0, "hello");
    bench.bytes(3, 5, "world");
    bench.end(3);
    EXPECT_EQ(bench.read(), Event::ended);
    EXPECT_EQ(bench.text, "helloworld");
    EXPECT_EQ(bench.receiver.accepted(), 10u);
}

TEST(JobReceiver, RepetitionsAreDroppedAndGapsRefused) {
    Bench bench;
    bench.begin(3, 10);
    bench.bytes(3, 0, "hello");
    bench.bytes(3, 2, "llo");
    bench.bytes(3, 7, "rld");
    bench.bytes(3, 3, "lowo");
    bench.begin(3, 10);
    bench.bytes(3, 0, "helloworld");
    bench.end(3);
    EXPECT_EQ(bench.read(), Event::ended);
    EXPECT_EQ(bench.text, "helloworld");
}

TEST(JobReceiver, AnEndBeforeTheLastByteIsDropped) {
    Bench bench;
    bench.begin(1, 4);
    bench.bytes(1, 0, "ab");
    bench.end(1);
    EXPECT_EQ(bench.read(), Event::begun);
    bench.bytes(1, 2, "cd");
    bench.end(1);
    EXPECT_EQ(bench.read(), Event::ended);
    bench.end(1);
    EXPECT_EQ(bench.read(), Event::none) << "it ends once";
}

TEST(JobReceiver, AClosedJobTakesNoMore) {
    Bench bench;
    bench.begin(1, 100);
    bench.bytes(1, 0, "ab");
    bench.read();
    bench.receiver.close();
    bench.bytes(1, 2, "cd");
    bench.end(1);
    EXPECT_EQ(bench.read(), Event::none);
    EXPECT_EQ(bench.text, "ab");
    bench.begin(1, 100);
    EXPECT_EQ(bench.read(), Event::none) << "the number was used";
    bench.begin(2, 3);
    EXPECT_EQ(bench.read(), Event::begun);
}

TEST(JobReceiver, AnotherJobWhileOneRunsIsRefused) {
    Bench bench;
    bench.begin(1, 2);
    bench.begin(2, 2);
    bench.bytes(2, 0, "xx");
    bench.bytes(1, 0, "ab");
    bench.read();
    EXPECT_EQ(bench.text, "ab");
    EXPECT_EQ(bench.receiver.job_id(), 1u);
    EXPECT_EQ(bench.receiver.refused(), 1u);
}

TEST(JobReceiver, BytesPastTheJobsLengthAreRefused) {
    Bench bench;
    bench.begin(1, 3);
    bench.bytes(1, 0, "abcd");
    bench.bytes(1, ~std::uint64_t{0}, "x");
    bench.read();
    EXPECT_EQ(bench.text, "");
    EXPECT_EQ(bench.receiver.refused(), 2u);
}

TEST(JobReceiver, UsesOneFrameBeforeItTakesTheNext) {
    Bench bench;
    bench.begin(1, 6);
    bench.bytes(1, 0, "abc");
    bench.bytes(1, 3, "def");
    EXPECT_EQ(bench.receiver.receive(*bench.ring), Event::begun);
    EXPECT_EQ(bench.receiver.receive(*bench.ring), Event::bytes);
    bench.receiver.use(1);
    EXPECT_EQ(bench.receiver.receive(*bench.ring), Event::bytes);
    EXPECT_EQ(bench.receiver.held().size(), 2u);
    EXPECT_EQ(bench.receiver.accepted(), 3u);
}

/// A sender that dies and comes back at random, starts again anywhere at or below what is
/// acknowledged, and damages frames: the bytes come out once and in order.
TEST(JobReceiver, WhateverTheSenderDoesTheBytesComeOutOnce) {
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        std::mt19937_64 random(seed);
        const auto below = [&](std::uint64_t n) { return random() % n; };
        std::string job(1 + below(5000), ' ');
        for (char& c : job) c = static_cast<char>('a' + below(26));
        Bench bench;
        bench.begin(9, job.size());
        bool ended = false;
        for (int tries = 0; tries < 20000 && !ended; ++tries) {
            std::uint64_t offset =
                bench.receiver.accepted() - std::min(bench.receiver.accepted(), below(200));
            const int frames = static_cast<int>(below(6));
            for (int i = 0; i < frames && offset < job.size(); ++i) {
                const std::uint64_t count = std::min<std::uint64_t>(1 + below(700), job.size() - offset);
                link::Frame frame = link::encode(link::JobBytes{
                    9, offset, {reinterpret_cast<const std::uint8_t*>(job.data()) + offset, count}});
                std::vector<std::uint8_t> raw(frame.bytes().begin(), frame.bytes().end());
                if (below(8) == 0) raw[below(raw.size())] ^= static_cast<std::uint8_t>(1 + below(255));
                ASSERT_TRUE(bench.ring->try_push_all(raw));
                offset += count;
            }
            if (below(3) == 0) bench.end(9);
            ended = bench.read() == Event::ended;
        }
        ASSERT_TRUE(ended) << "seed " << seed;
        ASSERT_EQ(bench.text, job) << "seed " << seed;
    }
}

}  // namespace
}  // namespace qduino::printer::machine::job_receiver_test
