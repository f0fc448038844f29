// Room on the disk that is kept for what must work when the disk is full: to delete a job, to hold
// the queue, to end a print. Without it a full disk could not even be emptied, since to delete is
// to write, too.
//
//   DIR/ballast   some MiB that are really taken; given up when a write finds no room
//
// Once it is given up, no upload is taken until it is there again: they would eat its room. It is
// made again as soon as the disk has place for it.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>

#include "base/time.h"

namespace qduino::spool {

class Ballast {
  public:
    static constexpr std::uint64_t kBytes = 4 << 20;
    static constexpr Nanoseconds kTryEvery = std::chrono::seconds{1};

    /// Makes it, if there is room.
    explicit Ballast(const std::filesystem::path& folder);

    /// True: there was some, and its room is free now.
    bool give_up();
    /// Makes it again when it is gone, now and then.
    void keep(Instant now);
    /// False: the disk is full. Any thread.
    [[nodiscard]] bool held() const { return held_.load(std::memory_order_relaxed); }

  private:
    void make();

    std::filesystem::path file_;
    std::atomic<bool> held_{false};
    Instant tried_{};
};

}  // namespace qduino::spool
