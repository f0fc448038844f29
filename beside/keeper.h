// Linux's heartbeat: a thread before all others counts a word up, for as long as Linux lets it.
#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "base/time.h"

namespace qduino::apps::beside_linux {

class Keeper {
  public:
    /// Counts `beats` up every `period`, on core 0. Said on standard error when it gets no
    /// priority.
    Keeper(std::atomic<std::uint64_t>& beats, Nanoseconds period);

  private:
    std::jthread thread_;
};

}  // namespace qduino::apps::beside_linux
