// Moves one run's bytes into the link's job ring, keeping the ring full.
//
//   bytes 0 ────────── accepted ──────────── sent ───────────────── length
//                      (sketch has them)     (in the ring)   (still to read)
//
// A frame may be dropped, and a feeder may have died in mid-job. So the feeder keeps no state that
// matters to the sketch: it may send everything up to `sent` again at any time, and the sketch
// drops what it has (frame.h, rules 2–4). In doubt it repeats: job_begin until the sketch names the
// run; bytes from `accepted`, when the ring ran empty and `accepted` still stands behind `sent`;
// job_end until the sketch reports an outcome. Memory: one frame.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "base/time.h"
#include "printer/link/layout.h"

namespace qduino::spool {

class LinkFeed {
  public:
    /// How long the sketch may be silent with an empty ring before the feeder repeats.
    static constexpr Nanoseconds kRepeatAfter = std::chrono::milliseconds{500};

    /// The run has `length` bytes. `estimated_s`: what the copy takes, 0 when nobody knows.
    LinkFeed(std::uint64_t run_id, std::uint64_t length, double estimated_s = 0);

    /// While the sketch has not named the run yet: sends job_begin, and the bytes from the start as
    /// far as they fit. Error: read_at()'s.
    [[nodiscard]] Result<void> begin(printer::link::LinkLayout& link, Instant now);
    /// When the sketch holds the run and has taken `accepted` bytes: sends as many of the others as
    /// fit. Error: read_at()'s.
    [[nodiscard]] Result<void> feed(printer::link::LinkLayout& link, std::uint64_t accepted, Instant now);

    /// The one or the other, as the link's own status asks: for a process that serves nobody else.
    [[nodiscard]] Result<void> feed_alone(printer::link::LinkLayout& link, Instant now);

    [[nodiscard]] std::uint64_t sent() const { return sent_; }

  protected:
    LinkFeed(LinkFeed&&) = default;
    LinkFeed& operator=(LinkFeed&&) = default;
    ~LinkFeed() = default;

  private:
    /// Reads into `bytes` from `offset` on: at least one byte, at most all. Error: corrupt, when
    /// they cannot be read.
    [[nodiscard]] virtual Result<std::size_t> read_at(std::uint64_t offset,
                                                      std::span<std::uint8_t> bytes) = 0;

    [[nodiscard]] Result<void> push_bytes(printer::link::LinkLayout& link);
    void push_end(printer::link::LinkLayout& link, Instant now);

    std::uint64_t run_id_;
    std::uint64_t length_;
    std::uint64_t estimated_s_;
    std::uint64_t sent_ = 0;
    std::uint64_t accepted_ = 0;
    bool feeding_ = false;  // feed() was called: sent_ continues what the sketch holds
    bool begin_sent_ = false;
    bool end_sent_ = false;
    Instant progress_at_{};  // when the sketch last took something, or something was repeated
};

}  // namespace qduino::spool
