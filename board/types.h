// The words of the seam: pins, buses, and what a board needs to know of a VCPU.
#pragma once

#include <array>
#include <atomic>
#include <compare>
#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "base/time.h"
#include "base/words.h"
#include "sched/vcpu.h"

namespace qduino::board {

/// A pin by its Arduino number. The board knows which line of which chip it is.
struct PinId {
    std::uint16_t number = 0;
    constexpr auto operator<=>(const PinId&) const = default;
};
inline constexpr std::uint16_t kPinCount = 128;

/// The range of a PWM's period: 1 Hz to 1 MHz.
inline constexpr Nanoseconds kPwmPeriodMin{1'000};
inline constexpr Nanoseconds kPwmPeriodMax{1'000'000'000};
/// 0 stands for the board's own period.
constexpr bool is_pwm_period(Nanoseconds period) {
    return period == Nanoseconds{0} || (period >= kPwmPeriodMin && period <= kPwmPeriodMax);
}
inline Error bad_pwm_period() {
    return make_error(ErrorCode::invalid_argument, "a PWM period is 1 us to 1 s, or 0 for the board's own");
}

enum class Level : std::uint8_t { low = 0, high = 1 };
enum class PinMode : std::uint8_t { input, input_pullup, input_pulldown, output, output_open_drain };
constexpr bool is_output(PinMode mode) {
    return mode == PinMode::output || mode == PinMode::output_open_drain;
}
enum class Edge : std::uint8_t { rising, falling, both };

struct I2cBus {
    std::uint8_t number = 0;
};
/// 7-bit address.
struct I2cAddress {
    std::uint8_t value = 0;
};
struct SpiBus {
    std::uint8_t number = 0;
};
struct SpiSettings {
    std::uint32_t clock_hz = 4'000'000;
    std::uint8_t mode = 0;  ///< 0…3: CPOL·2 + CPHA
    bool least_significant_first = false;
};

/// Device classes whose interrupts can be routed, and whose bottom halves an I/O VCPU can carry.
enum class DeviceClass : std::uint8_t { gpio, i2c, spi, uart, nic, disk, all };
inline constexpr int kDeviceClassCount = 6;  ///< without `all`
inline constexpr Words<DeviceClass::gpio, DeviceClass::disk> kDeviceNames{"gpio", "i2c", "spi",
                                                                          "uart", "nic", "disk"};

/// 1…32 is a sketch's loop. 0 is setup(), and any thread that is no VCPU. I/O VCPUs count from
/// kFirstIoVcpu.
using sched::VcpuId;
using sched::VcpuKind;
inline constexpr VcpuId kNoVcpu = 0;
inline constexpr VcpuId kMaxLoop = sched::kMainVcpuLimit;
inline constexpr VcpuId kFirstIoVcpu = kMaxLoop + 1;
inline constexpr VcpuId kVcpuLimit = kFirstIoVcpu + sched::kIoVcpuLimit;

/// What makes an execution slower than others: counts of the calling VCPU since it began.
struct Incidents {
    std::int64_t page_faults = 0;
    std::int64_t preemptions = 0;  ///< another took the core, or the scheduler moved the VCPU
    std::int64_t throttles = 0;    ///< its budget ended

    constexpr Incidents operator-(const Incidents& other) const {
        return {page_faults - other.page_faults, preemptions - other.preemptions,
                throttles - other.throttles};
    }
};

/// The top half of an edge, and how close two edges of a pin come at the most; an interval of 0
/// with a cost: nobody knows.
struct EdgeCost {
    Nanoseconds each{};
    Nanoseconds interval{};
};

/// A lock between VCPUs. 0 is free; the board decides what other values mean. It must not move
/// while it is in use.
struct LockWord {
    std::atomic<std::uint32_t> value{0};
};

/// A VCPU that a board is to run: already admitted, its core decided (0 … core_count()-1).
struct VcpuSpec : sched::Vcpu {
    bool owns_core = false;  ///< budget == period: never throttled, alone on its core
    bool classic = false;    ///< Arduino's own loop(): may allocate and lock (real_time_mark.h)
    /// Runs on the VCPU until the board stops; returns when stop_requested().
    void (*entry)(void*) = nullptr;
    void* context = nullptr;
    /// An I/O VCPU: what it may run without budget for those that wait for its locks; 0: it says
    /// nothing of them.
    Nanoseconds overrun{};
    /// A loop: how often a release asks for locks, as admission has it.
    int requests = 0;
};

}  // namespace qduino::board
