// The feeder: moves one run's bytes from its file into the link's job ring, keeping the ring full.
//
//   file  0 ────────── accepted ──────────── sent ───────────────── length
//                      (sketch has them)     (in the ring)   (still to read)
//
// A frame may be dropped, and a feeder may have died in mid-job. So the feeder keeps no state that
// matters to the sketch: it may send everything up to `sent` again at any time, and the sketch
// drops what it has (frame.h, rules 2–4). In doubt it repeats: job_begin until the sketch names the
// run; bytes from `accepted`, when the ring ran empty and `accepted` still stands behind `sent`;
// job_end until the sketch reports an outcome. Memory: one frame.
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"
#include "printer/link/layout.h"

namespace qduino::spool {

class Feeder {
  public:
    /// How long the sketch may be silent with an empty ring before the feeder repeats.
    static constexpr Nanoseconds kRepeatAfter = std::chrono::milliseconds{500};

    /// `file` holds `length` bytes. `estimated_s`: of the copy, 0 when nobody knows.
    Feeder(posix::UniqueFd file, std::uint64_t run_id, std::uint64_t length, double estimated_s = 0);
    /// Opens the file. Errors: not_found, corrupt (its size is not `length`).
    [[nodiscard]] static Result<Feeder> open(const std::filesystem::path& path, std::uint64_t run_id,
                                             std::uint64_t length, double estimated_s = 0);

    /// While the sketch has not named the run yet: sends job_begin, and the bytes from the start as
    /// far as they fit. Error: corrupt, when the file cannot be read.
    [[nodiscard]] Result<void> begin(printer::link::LinkLayout& link, Instant now);
    /// When the sketch holds the run and has taken `accepted` bytes: sends as many of the others as
    /// fit. Error: corrupt.
    [[nodiscard]] Result<void> feed(printer::link::LinkLayout& link, std::uint64_t accepted, Instant now);

    /// The one or the other, as the link's own status asks: for a process that serves nobody else.
    [[nodiscard]] Result<void> feed_alone(printer::link::LinkLayout& link, Instant now);

    [[nodiscard]] std::uint64_t sent() const { return sent_; }

  private:
    [[nodiscard]] Result<void> push_bytes(printer::link::LinkLayout& link);
    void push_end(printer::link::LinkLayout& link, Instant now);

    posix::UniqueFd file_;
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
