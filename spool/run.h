// A run: one attempt to print one copy of one job, and what has to be done about it next. Pure.
//
// A copy must never print twice and never be lost, whichever process is killed at whatever instant.
// Two facts survive and decide: the run that the store holds, and the sketch's words in the link.
//
//     1. the store commits  run(id, job, session)    before its first byte crosses the link
//     2. job_begin(id) and the bytes cross           ids grow; the sketch drops repeats (frame.h)
//     3. the sketch reports outcome(id)              stays readable until the next run begins
//     4. the store commits the outcome               only then may another run begin
//
// After a restart of the service at any point:
//
//     store has no run             → nothing crossed: the job is still queued
//     link of another session      → the sketch that had the run is gone: failed, with that reason
//     the sketch is dead or hung   → failed, with the supervisor's reason if that comes soon
//     sketch's last id < run's     → killed between 1 and 2: begin it
//     sketch's last id = run's     → killed after 2: feed from the acknowledged byte, or take the
//                                    outcome
//     sketch's last id > run's     → another service fed this sketch: failed
#pragma once

#include <cstdint>
#include <string>

#include "spool/job.h"
#include "spool/machine_view.h"

namespace qduino::spool {

/// As stored. The id is the link's job id.
struct Run {
    std::uint64_t id = 0;  ///< 0: none
    JobId job = 0;
    std::uint64_t session = 0;
    std::uint64_t length = 0;   ///< bytes of the job
    bool cancel_asked = false;  ///< a cancellation that was acknowledged to a person
    bool inspected = false;     ///< an inspector was told of its begin, and is owed its end
};

struct RunAction {
    enum class Kind : std::uint8_t {
        wait,   ///< the machine is not there, or says nothing new
        begin,  ///< send job_begin, then bytes from 0
        feed,   ///< keep bytes flowing, from `offset` if the feeder has to start there
        completed,
        cancelled,
        failed,  ///< with `reason`
    };
    Kind kind = Kind::wait;
    std::uint64_t offset = 0;
    std::string reason;
};

/// The action for the stored run, given this state of the machine. Contract: run.id is not 0.
[[nodiscard]] RunAction decide(const Run& run, const MachineView& machine);

/// Run numbers stay below this; a machine that names a higher one is damaged. It leaves room in
/// signed 64 bits.
inline constexpr std::uint64_t kRunIdMax = std::uint64_t{1} << 62;

/// True when this machine could take a new job now.
[[nodiscard]] bool is_ready(const MachineView& machine);

}  // namespace qduino::spool
