// The link between the sketch and the print service: one object in shared memory, laid out here and
// nowhere else.
//
//   service ── jobs (ring of frames) ──────► sketch     job bytes, each frame with its offset
//   service ── commands (ring of frames) ──► sketch     pause, resume, cancel, typed G-code lines …
//   service ── emergency (one atomic) ─────► sketch     read by loops 2 and 3 themselves, at once;
//                                                     that of the serial port writes it, too
//   sketch  ── replies (ring of frames) ───► service    console text; counted when dropped (full)
//   sketch  ── status (four-slots) ────────► service    machine, motion, heat: the newest, whole
//
// Each side may die and start again while the other runs on, and neither can trust what the other
// wrote. Four rules follow:
//
// - Nothing stale is read. The sketch makes a new object for every run, gives it a new session
//   number, and renames it over the old name.
// - The service may go and come back at any time. The sketch prints on with the bytes that it
//   holds.
// - No byte of a job is lost or taken twice. A frame of job bytes carries its offset. A service
//   that comes back sends again from `JobStatus::bytes_accepted`, or from anything before it. The
//   sketch drops what it already holds, and refuses a gap.
// - The reader checks everything. A frame has a magic number, a bounded length and a check sum
//   (frame.h), and each side checks that a field is in its range before it uses it.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/histogram.h"
#include "channel/four_slot.h"
#include "channel/ring_buffer.h"
#include "printer/machine_config.h"

namespace qduino::printer::link {

inline constexpr std::uint32_t kMagic = 0x51444C4B;  // "QDLK"
inline constexpr std::uint32_t kVersion = 12;

inline constexpr std::size_t kJobRingBytes = std::size_t{1} << 20;
inline constexpr std::size_t kCommandRingBytes = std::size_t{1} << 16;
inline constexpr std::size_t kReplyRingBytes = std::size_t{1} << 16;
inline constexpr std::size_t kMaxPayload = 4096;

enum class FrameType : std::uint8_t {
    job_begin = 1,  ///< payload: u64 job id, u64 length in bytes, u64 estimated seconds
    job_bytes = 2,  ///< payload: u64 job id, u64 offset, then the bytes
    job_end = 3,    ///< payload: u64 job id; after it the job's last byte has been sent
    command = 4,    ///< payload: u8 Command, then its text (gcode: one line)
    reply = 5,      ///< payload: u8 ReplyKind, then text
};

enum class Command : std::uint8_t {
    pause = 1,
    resume = 2,
    cancel = 3,
    /// One line, run between moves when no job runs, or queued behind the job's planned moves.
    gcode = 4,
    /// Back to idle after a fault or an emergency stop; refused while `fault_persists`.
    clear_fault = 5,
    /// One line of a serial host, carried out as a job's would be: what is not a move happens at
    /// its place in the motion. No text: a host begins, and G-code's modes are as at the start.
    host_line = 6,
};

/// The last three answer the line of a serial host.
enum class ReplyKind : std::uint8_t {
    text = 1,
    warning = 2,
    error = 3,
    host_text = 4,
    host_warning = 5,
    host_error = 6,
};

/// Lines of a serial host that may be in the sketch's hands; the sender counts by `host_lines`.
inline constexpr std::size_t kHostLinesMax = 128;

/// `LinkLayout::emergency` counts the emergency stops asked for. The sketch stops when it differs
/// from the last one that it served.
enum class MachineState : std::uint8_t {
    starting = 0,
    idle = 1,
    printing = 2,
    pausing = 3,
    paused = 4,
    cancelling = 5,
    faulted = 6,  ///< heaters off, motors idle; `fault` says why; clear_fault leaves it
};

enum class JobOutcome : std::uint8_t { none = 0, running = 1, completed = 2, cancelled = 3, failed = 4 };

/// What the machine does before a print moves on, or instead: `none` when it prints, or rests.
enum class Activity : std::uint8_t {
    none = 0,
    homing = 1,
    probing = 2,          ///< it measures the bed
    heating_hot_end = 3,  ///< it waits for the hot end to come to its target, or to cool to it
    heating_bed = 4,
    returning = 5,  ///< a resumed job's head is on its way back to the part
};

/// A line that a person typed beside a job, and that changes which part it makes: an object is
/// left out, or printed after all, or the flow is another.
struct TypedObject {
    std::uint64_t behind_line = 0;  ///< the job's last line that was read before it
    double left_mm = 0;             ///< of that line's filament, what was not planned yet
    FixedString<256> text;          ///< whole: its name tells one object from the others
};
inline constexpr std::size_t kTypedObjects = 8;

/// Written by loop 1.
struct JobStatus {
    /// Counts loop 1's releases; standing still means the sketch hangs.
    std::uint64_t heartbeat = 0;
    MachineState state = MachineState::starting;
    JobOutcome outcome = JobOutcome::none;
    std::uint64_t job_id = 0;  ///< the job of `outcome`; 0: none yet in this session
    std::uint64_t job_length = 0;
    /// Job bytes taken off the ring, in order: resume feeding here.
    std::uint64_t bytes_accepted = 0;
    std::uint64_t bytes_planned = 0;   ///< … parsed and planned
    std::uint64_t bytes_executed = 0;  ///< … whose moves have been played
    std::uint64_t line = 0;            ///< line number in the job, executed
    std::uint32_t unknown_codes = 0;
    std::uint32_t warnings = 0;
    std::uint32_t layer = 0;  ///< from 1, as preflight counts them; 0: none has begun
    Activity activity = Activity::none;
    double feed_factor = 1;  ///< M220
    double flow_factor = 1;  ///< M221
    /// Time of the running or last job, pauses excluded.
    double print_time_s = 0;
    double heating_time_s = 0;      ///< … of it, waiting for heat
    PerAxis<double> position_mm{};  ///< where the head is, as the program counts it
    std::array<bool, 3> homed{};
    /// Pulse counts at motor position 0: a motor's place in mm = (MotionStatus::steps − this) / its
    /// steps per mm (printer/kinematics.h).
    PerAxis<std::int64_t> origin_steps{};
    FixedString<128> message;  ///< M117
    FixedString<236> fault;    ///< why faulted, or why the last job failed
    /// While faulted: the fault that would come back at once; empty: the fault may be cleared.
    FixedString<160> fault_persists;
    bool parked = false;   ///< paused, and the head has moved away from the part
    bool may_jog = false;  ///< moves may be typed: idle, or paused with the head at rest
    /// How often the head has left the running or last job's path, and come back.
    std::uint32_t excursions = 0;
    std::uint64_t replies_dropped = 0;
    /// How many TypedObjects this job has had; number n, from 0, is at n % kTypedObjects.
    std::uint32_t typed_objects = 0;
    std::array<TypedObject, kTypedObjects> typed_object{};
    /// Lines of serial hosts that are over in this session: done, refused or dropped.
    std::uint64_t host_lines = 0;
};

/// Written by loop 2 (step/stepper_loop.h), often: what loops 1 and 3 need of it.
struct MotionCounts {
    std::uint64_t heartbeat = 0;
    /// Machine position in microsteps, counted as pulses went out.
    PerAxis<std::int64_t> steps{};
    PerAxis<std::uint64_t> pulses{};  ///< pulses ever sent
    std::uint64_t events_taken = 0;   ///< off the step ring, ever
    /// How far the print's own time line has been played; it runs on during a dwell.
    std::int64_t timeline_ns = 0;
    std::uint32_t last_marker = 0;
    /// The last stop request that loop 2 has carried out.
    std::uint32_t stops_served = 0;
    /// Homing runs of X, Y, Z that ended at the switch.
    PerAxis<std::uint32_t> endstop_hits{};
    bool moving = false;
};

/// … and what the service shows, which is large. Written more rarely.
struct MotionStatus : MotionCounts {
    std::uint64_t late_steps = 0;  ///< steps whose lateness moved the time line
    /// How far the time line has moved in this session; only lateness moves it.
    std::int64_t shift_ns = 0;
    std::uint64_t starved = 0;  ///< times the ring ran dry in mid-move
    std::uint32_t ring_fill = 0;
    Histogram lateness_ns;  ///< of every step in this session
};

struct HeaterStatus {
    double celsius = 0;
    double target_celsius = 0;  ///< 0: off
    double duty = 0;
    bool fault = false;
    bool reading = false;  ///< false: the sensor gives none, `celsius` is the last one
};

/// Written by loop 3.
struct HeatStatus {
    std::uint64_t heartbeat = 0;
    HeaterStatus hot_end;
    HeaterStatus bed;
    double fan_duty = 0;
    FixedString<160> fault;     ///< empty when none
    FixedString<160> persists;  ///< which sensor would fault again at once; empty: none
    double idle_timeout_s = 0;  ///< of the machine file; 0: never
    /// Time left until idle heaters go off; -1: not counting down.
    double idle_left_s = -1;
    /// The heaters went off because nobody used them, until a target is asked for again.
    bool idle_timed_out = false;
    /// The newest request for a temperature that was known when this sample was taken.
    std::uint32_t requests_seen = 0;
};

/// The heaters' numbers as M500 last kept them. The service writes them to disk: the sketch never
/// does.
struct KeptHeat {
    std::uint32_t number = 0;  ///< of the M500 in this session; 0: none yet
    HeaterSettings hot_end{};
    HeaterSettings bed{};
};

/// What holds, and how it has been kept so far: the guarantee report as JSON text, for the page.
/// Written once a second by the thread that the loops were started from, never by a loop.
struct GuaranteeText {
    FixedString<24'000> json;
};

/// Where the bytes of a serial host may be carried, and at which cost: the I/O VCPU that the sketch
/// has declared for its UART.
struct PortPlace {
    int core = 0;
    int priority = 0;  ///< SCHED_FIFO; 0: an ordinary process
    Nanoseconds budget{};
    Nanoseconds period{};
    Nanoseconds client{};  ///< period of the loop at whose rank it runs
    friend bool operator==(const PortPlace&, const PortPlace&) = default;
};
/// Written once by the process that runs the sketch, before `priority`; read by the one that
/// carries the bytes.
struct PortVcpu {
    std::atomic<std::int32_t> core{0};
    std::atomic<std::int64_t> budget_ns{0}, period_ns{0}, client_ns{0};
    std::atomic<std::int32_t> priority{0};

    void publish(const PortPlace& place) {
        core.store(place.core, std::memory_order_relaxed);
        budget_ns.store(to_ns(place.budget), std::memory_order_relaxed);
        period_ns.store(to_ns(place.period), std::memory_order_relaxed);
        client_ns.store(to_ns(place.client), std::memory_order_relaxed);
        priority.store(place.priority, std::memory_order_release);
    }
    [[nodiscard]] PortPlace place() const {
        PortPlace read{.priority = priority.load(std::memory_order_acquire)};
        if (read.priority == 0) return read;
        read.core = core.load(std::memory_order_relaxed);
        read.budget = Nanoseconds{budget_ns.load(std::memory_order_relaxed)};
        read.period = Nanoseconds{period_ns.load(std::memory_order_relaxed)};
        read.client = Nanoseconds{client_ns.load(std::memory_order_relaxed)};
        return read;
    }
};

/// The shared object. Zeroed memory plus the header fields is a valid, empty link.
struct LinkLayout {
    std::atomic<std::uint32_t> magic{0};  ///< written last by the creator
    std::uint32_t version = 0;
    std::uint64_t size = 0;     ///< sizeof(LinkLayout)
    std::uint64_t session = 0;  ///< random, not 0
    std::uint64_t started_unix_s = 0;
    std::uint32_t sketch_pid = 0;
    /// Set by the supervisor when the sketch has died (1) or hung (2).
    std::atomic<std::uint32_t> sketch_dead{0};
    std::atomic<std::uint32_t> emergency{0};  ///< incremented by the service, and by the port
    /// Incremented by the service. Nothing stops when it stands still.
    std::atomic<std::uint64_t> service_heartbeat{0};
    /// The process that feeds; a second feeder must not start while this one lives.
    std::atomic<std::uint32_t> service_pid{0};
    /// 1 once `death_note` may be read. That is some time after `sketch_dead`: nothing waits for
    /// the words.
    std::atomic<std::uint32_t> death_note_ready{0};
    /// How many of the printer's seconds pass in a second of the wall clock. Set by the process
    /// that runs the sketch; 0 and 1: real time.
    std::atomic<double> time_factor{1};
    /// What a step takes of loop 2's core, measured by it before anything moves; 0: not measured.
    std::atomic<std::int64_t> step_cost_ns{0};
    PortVcpu port_vcpu;
    /// When the port's process read its last M112; CLOCK_MONOTONIC.
    std::atomic<std::int64_t> port_stop_ns{0};
    /// How the sketch came to its end; written by the supervisor, ends with a 0.
    std::array<char, 236> death_note{};

    channel::RingBuffer<std::uint8_t, kJobRingBytes> jobs;
    channel::RingBuffer<std::uint8_t, kCommandRingBytes> commands;
    channel::RingBuffer<std::uint8_t, kReplyRingBytes> replies;
    channel::FourSlot<JobStatus> job_status;
    channel::FourSlot<MotionStatus> motion_status;
    channel::FourSlot<HeatStatus> heat_status;
    channel::FourSlot<KeptHeat> kept_heat;
    /// The beds of the same M500, written before the heaters' numbers.
    channel::FourSlot<KeptBeds> kept_beds;
    channel::FourSlot<GuaranteeText> guarantee;
};

}  // namespace qduino::printer::link
