// What the spool is told when it is opened.
#pragma once

#include <cstdint>

#include "spool/clock_watch.h"

namespace qduino::spool {

/// How long ended jobs are kept; 0: no limit of this kind. The job that ended first goes first,
/// with its files. Jobs that wait or print are never deleted.
struct Retention {
    std::int64_t jobs_max = 100'000;
    std::int64_t days_max = 0;
    std::uint64_t bytes_max = 0;  ///< of all stored files
};

struct SpoolOptions {
    bool hold_after_failure = true;  ///< a failed job holds the queue until a person releases it
    /// After a copy that moved, wait for a person to clear the bed.
    bool confirm_bed = true;
    Retention retention;
    /// Nothing is deleted by its age while the calendar is before this.
    UnixSeconds calendar_from_s = ClockWatch::kFirst_s;
};

}  // namespace qduino::spool
