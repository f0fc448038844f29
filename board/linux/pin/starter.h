// Lets a supervisor see the death of the program that started it, at once.
//
// The difficulty: a killed program counts as dead (its pidfd readable, its children signalled) only
// once all of it has left. As an ordinary process it waits for that among all others, and for its
// files on a busy disk. The signal of the kernel, SIGTERM, then stops the sketch in order: its
// longest loop ends its period, and an ordinary thread switches the pins. Seen with two busy
// processes: heaters on for 20 to 130 ms, and once for 331 ms.
//
//   starter     StarterLife: a thread that leaves first (board/linux/pin/death_witness.h), and a
//               word in memory that it holds
//   supervisor  Starter: looks at the word at each turn, 10 ms. Is the thread dead, the supervisor
//               kills the sketch and forces the pins itself, at its real-time priority
//
// The memory has no name in any folder. The supervisor inherits its descriptor.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "base/result.h"
#include "board/linux/pin/death_witness.h"
#include "posix/mapping.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// Belongs to the program that starts a supervisor. Not moved once it lives.
class StarterLife {
  public:
    /// Makes the memory and the thread: above every loop, where that is allowed. Setup-time. Error:
    /// the system's.
    Result<void> begin();
    /// For the supervisor's option --starter; valid in processes that inherited the descriptor.
    [[nodiscard]] std::string path() const;
    /// In the child that becomes the supervisor: it inherits the descriptor.
    void hand_on() const;

  private:
    posix::UniqueFd memory_;
    posix::Mapping mapping_;
    DeathWitness witness_;
};

/// As the supervisor sees it.
class Starter {
  public:
    Starter() = default;  ///< none: it never dies
    /// Opens what StarterLife::path() named. Error: the system's.
    static Result<Starter> open(const std::string& path);
    /// Real-time safe.
    [[nodiscard]] bool is_dead() const {
        if (!mapping_.valid()) return false;
        const auto& word = *mapping_.as<const std::atomic<std::uint32_t>>();
        return (word.load(std::memory_order_acquire) & kWitnessDied) != 0;
    }

  private:
    explicit Starter(posix::Mapping mapping) : mapping_(std::move(mapping)) {}
    posix::Mapping mapping_;
};

}  // namespace qduino::board::linux
