// Frames: every frame written is read back; a damaged one is refused, and the reader finds its
// place again.
#include "printer/link/frame.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "printer/link/crc32.h"

namespace qduino::printer::link::frame_test {
namespace {

using Ring = channel::RingBuffer<std::uint8_t, 1 << 14>;

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

std::string text_of(std::span<const std::uint8_t> bytes) { return {bytes.begin(), bytes.end()}; }

TEST(Crc32, MatchesThePublishedCheckValue) {
    EXPECT_EQ(crc32(bytes_of("123456789")), 0xCBF43926u);
    EXPECT_EQ(crc32(bytes_of("6789"), crc32(bytes_of("12345"))), 0xCBF43926u);
}

TEST(Frame, EveryTypeComesBackAsItWent) {
    auto ring = std::make_unique<Ring>();
    FrameReader reader;
    const auto payload = bytes_of("G1 X10\nG1 Y20\n");
    ASSERT_TRUE(try_push(*ring, encode(JobBegin{7, 14, 4804})));
    ASSERT_TRUE(try_push(*ring, encode(JobBytes{7, 0, payload})));
    ASSERT_TRUE(try_push(*ring, encode(JobEnd{7})));
    ASSERT_TRUE(try_push(*ring, encode(CommandText{Command::gcode, "M105"})));
    ASSERT_TRUE(try_push(*ring, encode(ReplyText{ReplyKind::warning, "cold"})));

    const auto next = [&] {
        const auto frame = reader.read(*ring);
        EXPECT_TRUE(frame.ok() && frame->has_value());
        return **frame;
    };
    const JobBegin begin = *decode_job_begin(next().payload);
    EXPECT_EQ(begin.job_id, 7u);
    EXPECT_EQ(begin.length, 14u);
    EXPECT_EQ(begin.estimated_s, 4804u);
    const JobBytes bytes = *decode_job_bytes(next().payload);
    EXPECT_EQ(bytes.offset, 0u);
    EXPECT_EQ(text_of(bytes.bytes), "G1 X10\nG1 Y20\n");
    EXPECT_EQ(decode_job_end(next().payload)->job_id, 7u);
    const CommandText command = *decode_command(next().payload);
    EXPECT_EQ(command.command, Command::gcode);
    EXPECT_EQ(command.text, "M105");
    const ReplyText reply = *decode_reply(next().payload);
    EXPECT_EQ(reply.kind, ReplyKind::warning);
    EXPECT_EQ(reply.text, "cold");
    EXPECT_FALSE(reader.read(*ring)->has_value());
    EXPECT_EQ(reader.corrupt_count(), 0u);
}

TEST(Frame, AFrameThatDoesNotFitIsNotPushedInPart) {
    auto ring = std::make_unique<Ring>();
    const std::vector<std::uint8_t> payload(kMaxJobBytes, 'x');
    int pushed = 0;
    while (try_push(*ring, encode(JobBytes{1, 0, payload}))) ++pushed;
    EXPECT_EQ(pushed, 3);
    EXPECT_EQ(ring->size(), 3 * kFrameMaxBytes);
}

TEST(Frame, LongTextIsCutAtTheFramesBound) {
    const std::string text(kMaxText + 100, 'a');
    EXPECT_EQ(encode(ReplyText{ReplyKind::text, text}).bytes().size(), kFrameMaxBytes);
}

TEST(Frame, EveryFlippedBitIsNoticed) {
    const Frame frame = encode(CommandText{Command::gcode, "G28 X"});
    for (std::size_t bit = 0; bit < frame.bytes().size() * 8; ++bit) {
        auto ring = std::make_unique<Ring>();
        std::vector<std::uint8_t> damaged(frame.bytes().begin(), frame.bytes().end());
        damaged[bit / 8] ^= static_cast<std::uint8_t>(1u << (bit % 8));
        ASSERT_TRUE(ring->try_push_all(damaged));
        FrameReader reader;
        const auto read = reader.read(*ring);
        ASSERT_FALSE(read.ok()) << "bit " << bit;
        EXPECT_EQ(read.error().code, ErrorCode::corrupt);
    }
}

TEST(Frame, EveryTruncationIsNoticedAndTheNextFrameIsRead) {
    const Frame frame = encode(CommandText{Command::gcode, "G28 X"});
    for (std::size_t length = 1; length < frame.bytes().size(); ++length) {
        auto ring = std::make_unique<Ring>();
        FrameReader reader;
        ASSERT_TRUE(ring->try_push_all(frame.bytes().first(length)));
        EXPECT_FALSE(reader.read(*ring).ok()) << length;
        ASSERT_TRUE(try_push(*ring, encode(JobEnd{9})));
        const auto next = reader.read(*ring);
        ASSERT_TRUE(next.ok() && next->has_value());
        EXPECT_EQ(decode_job_end((*next)->payload)->job_id, 9u);
        EXPECT_EQ(reader.corrupt_count(), 1u);
    }
}

TEST(Frame, PayloadsOfTheWrongFormAreRefused) {
    const std::vector<std::uint8_t> none;
    EXPECT_FALSE(decode_job_begin(none).ok());
    EXPECT_FALSE(decode_job_begin(std::vector<std::uint8_t>(16, 0)).ok()) << "job id 0";
    EXPECT_FALSE(decode_job_begin(std::vector<std::uint8_t>(17, 1)).ok());
    EXPECT_FALSE(decode_job_bytes(std::vector<std::uint8_t>(15, 1)).ok());
    EXPECT_FALSE(decode_job_bytes(std::vector<std::uint8_t>(17, 0xFF)).ok()) << "offset + size wraps";
    EXPECT_FALSE(decode_job_end(none).ok());
    EXPECT_FALSE(decode_command(none).ok());
    EXPECT_FALSE(decode_command(std::vector<std::uint8_t>{0}).ok());
    EXPECT_FALSE(decode_command(std::vector<std::uint8_t>{99}).ok());
    EXPECT_FALSE(decode_reply(std::vector<std::uint8_t>{7}).ok());
    EXPECT_FALSE(decode_reply(none).ok());
}

TEST(Frame, UnknownTypesAndTooLongFramesAreRefused) {
    for (const std::uint8_t type : {std::uint8_t{0}, std::uint8_t{6}, std::uint8_t{255}}) {
        auto ring = std::make_unique<Ring>();
        ASSERT_TRUE(try_push(*ring, encode_raw(type, bytes_of("x"))));
        FrameReader reader;
        EXPECT_FALSE(reader.read(*ring).ok()) << int{type};
    }
}

TEST(Frame, RandomMixesOfGoodAndBadNeverYieldAWrongFrame) {
    const std::uint64_t seed = 20170418;
    std::mt19937_64 random{seed};
    auto ring = std::make_unique<Ring>();
    FrameReader reader;
    std::uint64_t sent = 0, seen = 0;
    for (int round = 0; round < 20'000; ++round) {
        std::vector<std::uint8_t> junk(random() % 40);
        for (auto& byte : junk) byte = static_cast<std::uint8_t>(random());
        if (random() % 8 == 0) static_cast<void>(ring->try_push_all(junk));
        if (random() % 2) {
            if (try_push(*ring, encode(JobEnd{sent + 1}))) ++sent;
        } else {
            const auto frame = reader.read(*ring);
            if (!frame.ok() || !frame->has_value()) continue;
            const auto end = decode_job_end((*frame)->payload);
            ASSERT_TRUE(end.ok()) << "seed " << seed;
            ASSERT_GT(end->job_id, seen) << "seed " << seed;
            ASSERT_LE(end->job_id, sent) << "seed " << seed;
            seen = end->job_id;
        }
    }
    EXPECT_GT(reader.corrupt_count(), 100u);
    EXPECT_GT(seen, 1000u);
}

}  // namespace
}  // namespace qduino::printer::link::frame_test
