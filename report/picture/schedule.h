// A schedule as plain data: what each VCPU of each core did in a stretch of time, what was taken
// from the cores, and each loop's R beside its T. A recorder (recorder.h) or the critical instant
// (critical_instant.h) makes it; page.h draws it as SVG, strip.h as text.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/time.h"
#include "sched/vcpu.h"

namespace qduino::apps::picture {

using sched::VcpuId;

enum class Doing : std::uint8_t {
    runs,       ///< has the core
    waits,      ///< wants the core, and somebody else has it
    throttled,  ///< wants the core, and its budget is spent
    nothing,    ///< sleeps, or has no work: not kept in a schedule
};

inline constexpr Nanoseconds kUnknown{-1};

struct Stretch {
    Doing doing = Doing::runs;
    Instant from, until;
    /// Budget left at both ends; kUnknown: nobody knows, or the VCPU has no limit.
    Nanoseconds left_from = kUnknown, left_until = kUnknown;
};

struct Release {
    Instant at;                   ///< nominal start; where that is unknown, the wake-up
    std::optional<Instant> due;   ///< its deadline, where that is known
    std::optional<Instant> done;  ///< when its work ended, where that was seen
    std::optional<bool> met;      ///< none: it has not ended
};

/// A stretch of a core's time that an interrupt, or a switch between VCPUs, took.
struct Taken {
    Instant from, until;
    std::string what;
};

struct Row : sched::Vcpu {
    std::string name;
    bool owns_core = false;
    std::vector<Stretch> stretches;  ///< in order of time; do not overlap
    std::vector<Release> releases;   ///< in order of time
    /// Longest time from a release to its end, in the whole run.
    std::optional<Nanoseconds> worst_response;
};

struct Core {
    int number = 0;
    std::vector<Row> rows;     ///< by priority, highest first
    std::vector<Taken> taken;  ///< in order of time; do not overlap
};

/// R against T of one loop.
struct Response {
    std::string name;
    Nanoseconds budget{}, period{};
    std::optional<Nanoseconds> worst;  ///< R, as admission has worked it out; none: never
    std::optional<Nanoseconds> seen;   ///< the longest that was seen in a run
};

/// A stretch of a pin's time.
struct PinStretch {
    Instant from, until;  ///< the same: a pulse that took no time
    float height = 0;     ///< 0: low, 1: high, between: the duty of its PWM
};
/// What the board drove onto a pin.
struct PinRow {
    std::string name;                   ///< "pin 13"
    std::string remark;                 ///< what it did in the whole run
    std::vector<PinStretch> stretches;  ///< in order of time; do not overlap
};

struct Schedule {
    std::string title;
    std::string remark;       ///< what the picture shows, in one sentence or two
    Instant from, until;      ///< until > from
    std::vector<Core> cores;  ///< in order of number; those with something in them
    std::vector<Response> responses;
    std::vector<PinRow> pins;  ///< in order of number
    /// They are shown from `from` to here: some pins change too slowly for the window of the cores.
    Instant pins_until = from;
};

/// True when some VCPU ran for some time in the window.
[[nodiscard]] bool anything_ran(const Schedule& schedule);
/// The same window without what is in it: [from, pins_until).
[[nodiscard]] Schedule window_of_pins(const Schedule& schedule);

/// Puts the rows in order of priority, and what has nothing in it away.
void put_in_order(Schedule& schedule);

/// Rows of all cores.
[[nodiscard]] std::size_t row_count(const Schedule& schedule);

/// Where a picture may begin, and how long it may be, in seconds.
inline constexpr double kLatestStart = 86'400, kLongest = 3600;

/// A length that shows `vcpus` well: two of the longest periods; one, when the shortest period
/// comes more than 200 times in two. Loops that own a core count only when there are no others.
[[nodiscard]] Nanoseconds good_length(const std::vector<sched::Vcpu>& vcpus);

/// The part of `stretch` within the schedule's window, as a share of the window: 0 to 1.
struct Share {
    double from = 0, until = 0;
};
[[nodiscard]] Share share_of(const Schedule& schedule, Instant from, Instant until);

/// The window in `columns` equal parts: how much of each the stretches of a kind fill, 0 to 1.
[[nodiscard]] std::vector<double> filled(const Schedule& schedule, const Row& row, Doing doing, int columns);

}  // namespace qduino::apps::picture
