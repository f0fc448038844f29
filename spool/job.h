// A job: bytes that were stored whole, facts read from them, and a place in the queue.
//
//               ┌──────── hold ⇄ release ───────┐
//   upload ──► queued ──► printing ──► done  (the last copy; before it: queued again)
//                ▲            ├──────► cancelled
//                │            └──────► failed
//                └── start ──────────────┘            (printed again, as a new copy)
//
// Invariants: 0 ≤ copies_done ≤ copies; a queued job has copies_done < copies; at most one job is
// printing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace qduino::spool {

/// Seconds since 1970, UTC. A parameter, as all time is.
using UnixSeconds = std::int64_t;
/// In words, in the form of strftime(3); at most 31 bytes.
[[nodiscard]] std::string utc_text(UnixSeconds time_s, const char* form);
using JobId = std::int64_t;

/// As stored. People also see `held` and `paused`: these are `queued` with `hold`, and `printing`
/// on a paused machine.
enum class JobState : std::uint8_t { queued = 1, printing = 2, done = 3, cancelled = 4, failed = 5 };

/// The word used in the store and in the HTTP interface.
[[nodiscard]] std::string_view to_word(JobState state);

struct Job {
    JobId id = 0;
    std::string name{};      ///< for people; never part of a path
    std::uint64_t size = 0;  ///< bytes
    std::string sha256{};    ///< 64 hexadecimal digits; names the blob
    JobState state = JobState::queued;
    bool hold = false;
    int copies = 1;  ///< 1 … kMaxCopies
    int copies_done = 0;
    int priority = 0;  ///< −kMaxPriority … kMaxPriority; higher first
    /// Among waiting jobs of one priority the lower comes first. Among ended jobs the one that
    /// ended later has the higher. A clock that was set back cannot mix them.
    std::int64_t order = 0;
    UnixSeconds created_s = 0;
    UnixSeconds started_s = 0;  ///< of the running or last copy; 0: never
    UnixSeconds ended_s = 0;    ///< of the last copy; 0: never
    std::string error{};        ///< why it failed; empty otherwise
    /// The line at which its last copy failed or was cancelled; empty: unknown, or it did not.
    std::optional<std::int64_t> stopped_line{};
    std::optional<std::int64_t> stopped_layer{};  ///< likewise
    std::optional<std::int64_t> stopped_byte{};   ///< likewise: so many bytes of it were executed
    /// What its last copy took of the printer's time, pauses excluded; empty: unknown.
    std::optional<std::int64_t> printed_s{};
    std::string facts_json{};  ///< an object, as the analyzer made it
    double estimated_s = 0;    ///< of one copy; 0: unknown
    bool has_layers = false;
    bool has_thumbnail = false;
    /// The size of all files of its blob; jobs with the same bytes share them.
    std::uint64_t stored_bytes = 0;
};

/// True when no copy of the job prints or waits any more.
[[nodiscard]] constexpr bool is_ended(JobState state) {
    return state == JobState::done || state == JobState::cancelled || state == JobState::failed;
}

/// Jobs by their stored state.
struct JobCounts {
    std::int64_t queued = 0;  ///< held ones included
    std::int64_t printing = 0;
    std::int64_t done = 0;
    std::int64_t cancelled = 0;
    std::int64_t failed = 0;
    [[nodiscard]] std::int64_t& of(JobState state) {
        std::int64_t* const counts[] = {&queued, &printing, &done, &cancelled, &failed};
        return *counts[static_cast<int>(state) - static_cast<int>(JobState::queued)];
    }
    [[nodiscard]] std::int64_t ended() const { return done + cancelled + failed; }
    [[nodiscard]] std::int64_t total() const { return queued + printing + ended(); }
};

inline constexpr int kMaxCopies = 1000;
inline constexpr int kMaxPriority = 1000;

}  // namespace qduino::spool
