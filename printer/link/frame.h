// Frames: the bytes that cross the link's rings, and the rules by which a job's bytes arrive
// exactly once.
//
//    0        2      3          4            8          12                     12 + length
//   +--------+------+----------+------------+----------+----------------------+
//   | magic  | type | reserved | length     | crc32    | payload              |  all little-endian
//   | 0x4651 | u8   | 0        | u32 ≤ 4096 | u32      | by type, see below   |  crc32: of the rest
//   +--------+------+----------+------------+----------+----------------------+
//
// Writing: a frame goes in whole or not at all (RingBuffer::try_push_all). So a writer that is
// killed at any instant leaves only whole frames, and the end of what a ring holds is always the
// end of a frame.
//
// Reading: the reader checks a frame before it believes it. After a bad frame it cannot know where
// the next one starts. So it drops everything that the ring holds at that moment, and then stands
// at the start of a frame again. The drop loses nothing: the sender repeats a job's bytes from the
// acknowledged offset.
//
// The rules for jobs (the service is the sender, the sketch the receiver):
// 1. A job id names one attempt to print one copy. Ids only grow within one session of the link.
// 2. job_begin with an id not above the receiver's last (JobStatus::job_id) is a repetition and is
//    dropped. With a higher id while a job runs it is refused; the sender has to wait for the
//    outcome.
// 3. job_bytes of the running job at offset o, n bytes, when `accepted` bytes are held:
//      o + n ≤ accepted       a repetition: dropped
//      o ≤ accepted < o + n   the part past `accepted` is taken
//      o > accepted           a gap: dropped; `bytes_accepted` stands still, the sender goes back
// 4. job_end completes the job once accepted == length. Before that it is dropped, and the sender
//    repeats it.
// 5. Frames of any other job are dropped. So the sender may die at any time, and its successor may
//    send everything again from `bytes_accepted` or below.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "base/result.h"
#include "channel/ring_buffer.h"
#include "printer/link/layout.h"

namespace qduino::printer::link {

inline constexpr std::uint16_t kFrameMagic = 0x4651;  // "QF"
inline constexpr std::size_t kFrameHeaderBytes = 12;
inline constexpr std::size_t kFrameMaxBytes = kFrameHeaderBytes + kMaxPayload;

/// The most job bytes that one job_bytes frame carries.
inline constexpr std::size_t kMaxJobBytes = kMaxPayload - 16;
/// The longest text of one command or reply.
inline constexpr std::size_t kMaxText = kMaxPayload - 1;

/// A frame ready to be pushed.
class Frame {
  public:
    [[nodiscard]] std::span<const std::uint8_t> bytes() const { return {bytes_.data(), size_}; }

  private:
    friend class FrameBuilder;
    std::array<std::uint8_t, kFrameMaxBytes> bytes_;
    std::size_t size_ = 0;
};

/// A frame as read: `payload` stays valid until the reader reads again.
struct FrameView {
    FrameType type;
    std::span<const std::uint8_t> payload;
};

struct JobBegin {
    std::uint64_t job_id = 0;       ///< not 0
    std::uint64_t length = 0;       ///< bytes
    std::uint64_t estimated_s = 0;  ///< of one copy, whole seconds; 0: not known
};
struct JobBytes {
    std::uint64_t job_id = 0;
    std::uint64_t offset = 0;  ///< of the first of `bytes` in the job
    std::span<const std::uint8_t> bytes;
};
struct JobEnd {
    std::uint64_t job_id = 0;
};
struct CommandText {
    Command command;
    std::string_view text;  ///< gcode, host_line: one line without its end; otherwise empty
};
struct ReplyText {
    ReplyKind kind;
    std::string_view text;
};

// ---- writing ------------------------------------------------------------------------------------

/// Contract: job_id is not 0.
[[nodiscard]] Frame encode(const JobBegin& begin);
/// Contract: at most kMaxJobBytes bytes.
[[nodiscard]] Frame encode(const JobBytes& bytes);
[[nodiscard]] Frame encode(const JobEnd& end);
/// Text past kMaxText is cut. Check a command's length first; a reply may be cut.
[[nodiscard]] Frame encode(const CommandText& command);
[[nodiscard]] Frame encode(const ReplyText& reply);
/// Any payload under any type: for tests.
[[nodiscard]] Frame encode_raw(std::uint8_t type, std::span<const std::uint8_t> payload);

/// Pushes the whole frame; or nothing, and false, when it does not fit now. Writer's side;
/// wait-free.
template <std::size_t N>
[[nodiscard]] bool try_push(channel::RingBuffer<std::uint8_t, N>& ring, const Frame& frame) {
    return ring.try_push_all(frame.bytes());
}

// ---- reading ------------------------------------------------------------------------------------

// Payloads. Error: corrupt, when the payload does not have the form of its type.
[[nodiscard]] Result<JobBegin> decode_job_begin(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<JobBytes> decode_job_bytes(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<JobEnd> decode_job_end(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<CommandText> decode_command(std::span<const std::uint8_t> payload);
[[nodiscard]] Result<ReplyText> decode_reply(std::span<const std::uint8_t> payload);

/// Takes frames off one ring. One per reading side; no heap; bounded work per call (one frame).
class FrameReader {
  public:
    /// The oldest frame; empty when the ring is. Error: corrupt; everything held was dropped. Call
    /// again.
    template <std::size_t N>
    [[nodiscard]] Result<std::optional<FrameView>> read(channel::RingBuffer<std::uint8_t, N>& ring) {
        const std::size_t held = ring.size();
        if (held == 0) return std::optional<FrameView>{};
        if (held < kFrameHeaderBytes) return drop(ring, "link: part of a frame header");
        ring.pop_some(std::span{buffer_}.first(kFrameHeaderBytes));
        const Result<std::size_t> length = check_header(held - kFrameHeaderBytes);
        if (!length.ok()) return drop(ring, length.error().message);
        ring.pop_some(std::span{buffer_}.subspan(kFrameHeaderBytes, *length));
        if (!checksum_fits(*length)) return drop(ring, "link: frame check sum differs");
        return std::optional{view(*length)};
    }

    /// Bad frames met so far.
    [[nodiscard]] std::uint64_t corrupt_count() const { return corrupt_count_; }

  private:
    template <std::size_t N>
    Error drop(channel::RingBuffer<std::uint8_t, N>& ring, std::string_view why) {
        ring.discard_all();
        ++corrupt_count_;
        return make_error(ErrorCode::corrupt, why);
    }
    /// The length of the payload, from the header in the buffer, when `available` bytes follow it.
    [[nodiscard]] Result<std::size_t> check_header(std::size_t available) const;
    [[nodiscard]] bool checksum_fits(std::size_t length) const;
    [[nodiscard]] FrameView view(std::size_t length) const;

    std::array<std::uint8_t, kFrameMaxBytes> buffer_{};
    std::uint64_t corrupt_count_ = 0;
};

}  // namespace qduino::printer::link
