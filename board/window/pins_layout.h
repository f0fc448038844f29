// The virtual hardware between a sketch and a virtual machine: one shared-memory file, laid out
// here and nowhere else.
//
//       sketch process                 shared file                     machine process (twin)
//   ┌─────────────────┐     ┌──────────────────────────────┐        ┌───────────────────────────┐
//   │ loop 1 ─ edges ─┼────►│ ring of VCPU 1               │        │                           │
//   │ loop 2 ─ edges ─┼────►│ ring of VCPU 2 (wide: owner) ├ merged►│ Peripherals::pin_written …│
//   │ loop 3 ─ edges ─┼────►│ ring of VCPU 3               │ by time│                           │
//   │      pin_read ◄─┼─────┤ input levels, edge counts    │◄───────┤ Peripherals::pin_level    │
//   │ i2c/spi/adc ◄───┼────►│ mailbox of each VCPU         │◄──────►│ Peripherals::i2c_transfer…│
//   └─────────────────┘     │ output latches, safe states, │        └───────────────────────────┘
//   ┌─────────────────┐     │ heartbeats                   │
//   │ supervisor edges┼────►│ ring of the supervisor       │
//   └─────────────────┘     └──────────────────────────────┘
//
// The machine side creates the file and outlives the sketch. Every writer has its own ring, so no
// loop ever waits for another. A full ring loses the edge and counts it, and the writer goes on.
//
// Order across rings. The machine must play the edges of all rings in the order of their times, but
// a writer reads its clock some instants before its edge is in the ring. So the machine must know
// up to which time nothing more will come. A full fence in every write to a pin would tell it; but
// each write would then wait for the cache lines of the one before. A flag and a bound in time do
// without:
//
//   writer   ──[writing:=1]──(t := now)──[push t]──[writing:=0]──
//   machine  ──(h)── kSettle ──[writing == 0?]──[drain the ring up to h]──
//
// The writer raises `writing` *before* it reads CLOCK_MONOTONIC, which all processes share, and
// lowers it after the push. The machine asks only about the past, kSettle after it. If it then sees
// `writing` low, whatever is not yet in the ring will carry a time after h: a write with a time up
// to h raised its flag before h, and a store made by h is visible kSettle later. So the merge up to
// h is exact.
//
// kSettle covers two things that are thousands of times shorter. A store waits in its core until
// the stores in front of it have left (well below 1 us; interrupts and traps empty the store
// buffer). And two processes read the same clock slightly apart (board/linux/kernel/cycle_clock.h).
// The idea is that of Morrison and Afek, "Temporally Bounding TSO for Fence-Free Asymmetric
// Synchronization", ASPLOS 2015.
//
// A writer that is preempted or throttled in between holds the horizon back for at most kWriterHold
// (a busy computer takes an ordinary process off its core for that long). Then the others go on
// without it. A dead writer holds up nobody.
//
// Ownership: the machine holds an OFD lock on byte 0, the sketch on byte 1, the supervisor on byte
// 2. The kernel drops them with the process, however it died. So a second sketch is refused exactly
// while the first one lives.
//
// A sketch in an emulated machine (board/metal/pins_window.h) has the same file as its memory, and
// a clock of its own: it stamps edges with that, and tells the machine side in `sketch_clock_ns`
// what time it is. It holds no lock and hears no futex.
#pragma once

#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "base/contract.h"
#include "base/time.h"
#include "board/types.h"
#include "board/window/edge_times.h"
#include "channel/ring_buffer.h"

namespace qduino::board {

inline constexpr std::uint32_t kPinsMagic = 0x51445049;  // "QDPI"
inline constexpr std::uint32_t kPinsVersion = 8;

enum class PinEventKind : std::uint8_t { level = 1, pwm = 2, pwm_period = 3 };

struct PinEvent {
    std::int64_t time_ns = 0;  ///< CLOCK_MONOTONIC
    std::uint16_t pin = 0;
    PinEventKind kind = PinEventKind::level;
    Level level = Level::low;  ///< of kind level
    /// Kind pwm: the bits of the duty, a float of 0…1. Kind pwm_period: nanoseconds; 0: the
    /// board's own.
    std::uint32_t value = 0;
};
static_assert(sizeof(PinEvent) == 16);

/// 2 MB: 1.3 s at 100 000 edges/s. Every VCPU has one.
using NarrowRing = channel::RingBuffer<PinEvent, std::size_t{1} << 17>;
/// 16 MB: 10 s at 100 000 edges/s. For loops that own a core and play pulses.
using WideRing = channel::RingBuffer<PinEvent, std::size_t{1} << 20>;

// Writers: one per VCPU, the sketch's last will (its fatal-signal handler), the supervisor, its
// heat watch, and the wide ones.
inline constexpr int kWillWriter = kVcpuLimit;
inline constexpr int kSupervisorWriter = kVcpuLimit + 1;
inline constexpr int kHeatWatchWriter = kVcpuLimit + 2;
inline constexpr int kNarrowWriters = kVcpuLimit + 3;
inline constexpr int kWideWriters = 4;
inline constexpr int kWriterCount = kNarrowWriters + kWideWriters;

/// After this long every core sees a store, and every clock shows a later time.
inline constexpr Nanoseconds kSettle = 20us;
/// How long a writer that stopped in the middle of a write holds the others back.
inline constexpr Nanoseconds kWriterHold = 250ms;
/// How long a bus transaction waits for the machine before it fails with timed_out.
inline constexpr Nanoseconds kBusTimeout = 50ms;

struct alignas(channel::kCacheLine) WriterSlot {
    /// 0: never; else 1 + VcpuId. Its ring is touched only once this is set.
    std::atomic<std::uint32_t> in_use{0};
    std::atomic<std::uint32_t> writing{0};  ///< between reading the clock and the push
    std::atomic<std::uint64_t> lost{0};     ///< edges that found the ring full
};

/// Written by the sketch (and the supervisor).
struct OutputPin {
    std::atomic<std::uint8_t> mode{0};   ///< 0: never set; else 1 + PinMode
    std::atomic<std::uint8_t> level{0};  ///< the output latch
    std::atomic<std::uint8_t> pwm{0};    ///< 1: the last write was a PWM duty
    std::atomic<std::uint8_t> safe{0};   ///< 0: none; else 1 + Level
    // The kernel device behind this pin when it is real, so that a process that outlives the sketch
    // can make it safe. Set before the pin can be driven.
    std::atomic<std::uint32_t> line{0};         ///< GPIO: 0, or ChipPlace::word()
    std::atomic<std::uint32_t> pwm_channel{0};  ///< PWM: 0, or ChipPlace::word()

    void set_mode(PinMode asked) {
        mode.store(static_cast<std::uint8_t>(1 + static_cast<unsigned>(asked)), std::memory_order_release);
    }
    [[nodiscard]] bool is_set() const { return mode.load(std::memory_order_acquire) != 0; }
    [[nodiscard]] bool drives() const {
        const std::uint8_t stored = mode.load(std::memory_order_acquire);
        return stored != 0 && is_output(static_cast<PinMode>(stored - 1));
    }
    void set_safe(Level asked) {
        safe.store(static_cast<std::uint8_t>(1 + static_cast<unsigned>(asked)), std::memory_order_release);
    }
    [[nodiscard]] std::optional<Level> safe_level() const {
        const std::uint8_t stored = safe.load(std::memory_order_acquire);
        if (stored == 0) return std::nullopt;
        return stored > 1 ? Level::high : Level::low;
    }
};

/// A line of a kernel GPIO chip, or a channel of a PWM chip.
struct ChipPlace {
    unsigned chip = 0;
    unsigned number = 0;

    /// Contract: both are below 0xffff.
    [[nodiscard]] std::uint32_t word() const {
        QDUINO_EXPECT(chip < 0xffff && number < 0xffff);
        return 1 + number + (chip << 16);
    }
    static ChipPlace from(std::uint32_t word) { return {(word - 1) >> 16, (word - 1) & 0xffff}; }
};

/// Written by the machine.
struct InputPin {
    std::atomic<std::uint32_t> level{0};
    std::atomic<std::uint32_t> rising{0};  ///< edges ever published
    std::atomic<std::uint32_t> falling{0};
    // When they were published; CLOCK_MONOTONIC.
    EdgeTimes rising_times;
    EdgeTimes falling_times;
};

/// The core and priority of a loop: to find out why it did not run
/// (board/linux/kernel/core_rivals.h).
struct LoopPlace {
    int core = -1;     ///< −1: not said
    int priority = 0;  ///< SCHED_FIFO; 0: an ordinary task

    [[nodiscard]] bool known() const { return core >= 0; }
    [[nodiscard]] std::uint32_t word() const {
        return (static_cast<std::uint32_t>(core) + 1) | static_cast<std::uint32_t>(priority) << 16;
    }
    static LoopPlace from(std::uint32_t word) {
        return {static_cast<int>(word & 0xffff) - 1, static_cast<int>(word >> 16)};
    }
};

/// Two promises of a loop: "you will hear of me by then", and "I shall have got on by then". That
/// of VCPU 0 is setup()'s, which makes the second alone.
struct alignas(channel::kCacheLine) Heartbeat {
    std::atomic<std::int64_t> expected_by_ns{0};     ///< CLOCK_MONOTONIC; 0: not watched
    std::atomic<std::int64_t> progress_by_ns{0};     ///< CLOCK_MONOTONIC; 0: not promised
    std::atomic<std::int64_t> progress_limit_ns{0};  ///< the time between two, at most
    std::atomic<std::uint64_t> count{0};
    std::atomic<std::uint32_t> place{0};  ///< LoopPlace::word(), or 0
};

inline constexpr std::size_t kMailBytes = 1024;  ///< largest bus transaction, each way
inline constexpr std::size_t kMailWords = kMailBytes / sizeof(std::uint64_t);

enum class MailKind : std::uint8_t { sync = 1, i2c = 2, spi = 3, analog = 4 };

/// What precedes the bytes of a request. Trivially copyable; crosses as words.
struct MailHead {
    MailKind kind = MailKind::sync;
    std::uint8_t bus = 0;
    std::uint8_t address = 0;
    std::uint8_t spi_mode = 0;
    std::uint32_t spi_clock_hz = 0;
    std::uint16_t pin = 0;
    std::uint16_t out_size = 0;
    std::uint16_t in_size = 0;
    std::uint8_t spi_lsb_first = 0;
    std::uint8_t reserved = 0;
};
static_assert(sizeof(MailHead) == 16);

/// One transaction at a time of one VCPU. A client that gave up may write its next request while
/// the machine still reads the last. So this is a seqlock: the sequence number is odd while a
/// request is being written, the bytes are copied as relaxed atomic words, and the reader looks at
/// the sequence again after the copy.
struct alignas(channel::kCacheLine) Mailbox {
    std::atomic<std::uint32_t> request{0};  ///< sequence of the latest request
    std::array<std::atomic<std::uint64_t>, 2> head{};
    std::array<std::atomic<std::uint64_t>, kMailWords> out{};

    /// Sequence that `in` answers; futex.
    alignas(channel::kCacheLine) std::atomic<std::uint32_t> reply{0};
    /// 0, or 1 + ErrorCode; then `in` holds the error's text …
    std::atomic<std::uint32_t> failed{0};
    std::atomic<std::uint32_t> text_size{0};    ///< … of so many bytes
    std::atomic<std::uint64_t> analog_bits{0};  ///< the double of an analog reply
    std::array<std::atomic<std::uint64_t>, kMailWords> in{};
};

inline constexpr std::int64_t kWardenLeft = -1;

/// How a sketch came to its end.
enum class SketchDeath : std::uint32_t { none = 0, died = 1, hung = 2 };

/// The head of the file. The rings follow it; each process maps only those that it uses
/// (ring_offset()).
struct PinsLayout {
    std::atomic<std::uint32_t> magic{0};  ///< written last by the creator
    std::uint32_t version = 0;
    std::uint64_t size = 0;  ///< of the whole file
    std::uint64_t machine_session = 0;
    std::atomic<std::uint32_t> machine_pid{0};
    std::atomic<std::int64_t> machine_alive_ns{0};  ///< CLOCK_MONOTONIC of the machine's last poll

    std::atomic<std::uint32_t> sketch_pid{0};
    std::atomic<std::uint64_t> sketch_session{0};  ///< counts sketches that attached
    /// SketchDeath; set by the supervisor, cleared by the next sketch.
    std::atomic<std::uint32_t> sketch_dead{0};
    /// The sketch's thread that dies first (board/linux/pin/death_witness.h): 0 or its number;
    /// kWitnessDied is set by the kernel.
    std::atomic<std::uint32_t> witness{0};
    /// The time on the sketch's own clock, as of its last write or request; 0: it has none, but
    /// CLOCK_MONOTONIC. The machine side makes it 1 before there is a sketch.
    std::atomic<std::int64_t> sketch_clock_ns{0};
    /// Inputs are as of this instant on the sketch's clock: all edges up to it were played.
    std::atomic<std::int64_t> inputs_as_of_ns{0};
    /// Shortest bound of a heartbeat; the supervisor sets it before it starts the sketch. 0: no
    /// supervisor.
    std::atomic<std::int64_t> heartbeat_bound_ns{0};
    /// The process that keeps the sketch's budgets (board/linux/loop/warden.h); 0: none.
    std::atomic<std::uint32_t> warden{0};
    /// CLOCK_MONOTONIC by which it looks again, at the latest, if it is not dead; kWardenLeft: all
    /// its wards have ended, and it has gone.
    std::atomic<std::int64_t> warden_by_ns{0};

    /// Futex: a request has come.
    alignas(channel::kCacheLine) std::atomic<std::uint32_t> doorbell{0};
    /// Futex: an input pin changed.
    alignas(channel::kCacheLine) std::atomic<std::uint32_t> input_changes{0};
    std::atomic<std::uint32_t> input_waiters{0};

    alignas(channel::kCacheLine) std::array<OutputPin, kPinCount> outputs{};
    alignas(channel::kCacheLine) std::array<InputPin, kPinCount> inputs{};
    std::array<Heartbeat, kVcpuLimit> heartbeats{};
    std::array<WriterSlot, kWriterCount> writers{};
    std::array<Mailbox, kVcpuLimit> mail{};
};

static_assert(std::atomic<std::uint8_t>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);

// ---- where the rings are ------------------------------------------------------------------------
inline constexpr std::size_t kPinsPage = std::size_t{1}
                                         << 16;  // a multiple of every page size in use (4–64 KiB)
constexpr std::size_t round_to_page(std::size_t bytes) {
    return (bytes + kPinsPage - 1) / kPinsPage * kPinsPage;
}

constexpr bool is_wide(int writer) { return writer >= kNarrowWriters; }
constexpr std::size_t ring_bytes(int writer) {
    return round_to_page(is_wide(writer) ? sizeof(WideRing) : sizeof(NarrowRing));
}
constexpr std::size_t ring_offset(int writer) {
    const std::size_t first = round_to_page(sizeof(PinsLayout));
    if (!is_wide(writer)) return first + static_cast<std::size_t>(writer) * ring_bytes(0);
    return first + kNarrowWriters * ring_bytes(0) +
           static_cast<std::size_t>(writer - kNarrowWriters) * ring_bytes(kNarrowWriters);
}
/// The file is sparse: only rings that are used take memory. A power of two, as the memory of a PCI
/// device is.
inline constexpr std::size_t kPinsFileSize = std::bit_ceil(ring_offset(kWriterCount));

}  // namespace qduino::board
