// What took the time of a core, as the kernel counts it since boot.
//
//   /proc/stat        cpu1 … irq, softirq, steal    interrupts, the hypervisor: in steps of 10 ms
//                                                   (USER_HZ)
//   /proc/interrupts  a count for each interrupt and core
//
// Not real-time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/time.h"

namespace qduino::board::linux {

struct CoreTimes {
    std::optional<Nanoseconds> host;  ///< nothing: this kernel does not tell
    /// In interrupts, hard and soft. A kernel without CONFIG_IRQ_TIME_ACCOUNTING takes what its
    /// tick meets.
    std::optional<Nanoseconds> interrupted;
    std::map<std::string, std::uint64_t> interrupts;  ///< by name; empty: it does not tell
};

/// `root` precedes /proc (tests).
CoreTimes core_times(int core, const std::string& root = "");

struct InterruptCounts {
    std::uint64_t ticks = 0;  ///< of the core's own timer: the tick, and alarms of programs
    std::uint64_t others = 0;

    [[nodiscard]] std::uint64_t all() const { return ticks + others; }
};

/// What `core` has served. Nothing when that cannot be read.
std::optional<InterruptCounts> interrupt_counts_of(int core, const std::string& root = "");

/// Interrupts of all kinds that `core` has served. Nothing when that cannot be read.
std::optional<std::uint64_t> interrupts_of(int core, const std::string& root = "");

}  // namespace qduino::board::linux
