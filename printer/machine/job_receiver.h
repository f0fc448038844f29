// The sketch's side of job feeding: frames off the link's ring, the rules of link/frame.h applied,
// bytes handed on in order and exactly once.
//
//   ring ─► frame ─► rules ─► held bytes (one frame at most) ─► a parser, at its own pace
//
// A frame is taken only when the last one has been used up, so an unread job waits in the ring and
// the sender sees it full: that is all the flow control there is. Loop 1 only; no heap.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "printer/link/frame.h"

namespace qduino::printer::machine {

class JobReceiver {
  public:
    using Ring = channel::RingBuffer<std::uint8_t, link::kJobRingBytes>;

    enum class Event : std::uint8_t {
        none,   ///< nothing to read now
        begun,  ///< a job began: job_id(), length()
        bytes,  ///< held() has bytes
        ended,  ///< the running job is whole: every byte of it was held once
    };

    /// Reads on until something happens. Bounded: at most `frames_max` frames.
    Event receive(Ring& ring, int frames_max = 64);

    /// Bytes of the running job, in order, not yet used.
    [[nodiscard]] std::span<const std::uint8_t> held() const {
        return std::span{buffer_}.first(held_end_).subspan(held_begin_);
    }
    /// Contract: count <= held().size().
    void use(std::size_t count) {
        QDUINO_EXPECT(count <= held_end_ - held_begin_);
        held_begin_ += count;
    }

    /// No more of the running job is wanted: it has ended, one way or another.
    void close() {
        running_ = false;
        held_begin_ = held_end_ = 0;
    }

    [[nodiscard]] bool running() const { return running_; }
    [[nodiscard]] std::uint64_t job_id() const { return job_id_; }
    [[nodiscard]] std::uint64_t length() const { return length_; }
    /// What the service estimates for it; 0: not known.
    [[nodiscard]] std::uint64_t estimated_s() const { return estimated_s_; }
    /// Bytes of the job taken in order so far; a feeder resumes here.
    [[nodiscard]] std::uint64_t accepted() const { return accepted_; }
    /// Frames that broke a rule or a check sum.
    [[nodiscard]] std::uint64_t refused() const { return refused_; }

  private:
    Event take(const link::FrameView& frame);
    Event refuse() { return ++refused_, Event::none; }
    Event take_begin(std::span<const std::uint8_t> payload);
    Event take_bytes(std::span<const std::uint8_t> payload);
    Event take_end(std::span<const std::uint8_t> payload);

    link::FrameReader reader_;
    std::array<std::uint8_t, link::kMaxJobBytes> buffer_{};
    std::size_t held_begin_ = 0;
    std::size_t held_end_ = 0;
    bool running_ = false;
    bool ended_ = false;
    std::uint64_t job_id_ = 0;
    std::uint64_t length_ = 0;
    std::uint64_t estimated_s_ = 0;
    std::uint64_t accepted_ = 0;
    std::uint64_t refused_ = 0;
};

}  // namespace qduino::printer::machine
