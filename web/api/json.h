// The objects of the HTTP interface (docs/api.md) as JSON: what needs the spool.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "spool/spool.h"
#include "web/api/machine_json.h"
#include "web/http/http.h"

namespace qduino::web::api {

/// The member `name` of the body, an object; nothing when it is no text.
[[nodiscard]] std::optional<std::string> text_member(std::string_view body, const char* name);

/// "2026-11-21T06:00:00Z"; null for 0.
[[nodiscard]] Json time_json(spool::UnixSeconds time_s);
[[nodiscard]] Json job_json(const spool::Spool& spool, const spool::Job& job);

/// The place of a queued job.
struct Place {
    std::size_t position = 0;  ///< 1-based
    /// Correct if every estimate holds; nothing when one is unknown, or the job is held.
    std::optional<double> starts_in_s;
    std::optional<double> ready_in_s;  ///< all of its copies
};
/// Places of all queued jobs.
[[nodiscard]] std::map<spool::JobId, Place> places_of(const spool::Spool& spool);
/// {"jobs":[…],"next_before":…,"counts":{…},"queue":{…}}: one page of the list, with what concerns
/// the whole list.
[[nodiscard]] Result<Json> page_json(const spool::Spool& spool, const spool::JobQuery& query);
/// The first page: for the live stream. Without jobs when the journal cannot be read.
[[nodiscard]] Json jobs_json(const spool::Spool& spool);
/// Reads the parameters limit, before, state and q of GET /api/v1/jobs, as they stand behind the
/// `?`. `running_word` is the present word for a printing job, "printing" or "paused". Errors:
/// invalid_argument, out_of_range, with words.
[[nodiscard]] Result<spool::JobQuery> job_query_of(std::string_view parameters,
                                                   std::string_view running_word);
[[nodiscard]] Json status_json(const spool::Spool& spool);
/// The word of `state` in the status object, "disconnected" included.
[[nodiscard]] std::string_view machine_word(const spool::MachineView& machine);
/// True when axes may be moved by hand now: the machine allows it, and no job is about to begin.
[[nodiscard]] bool may_jog(const spool::Spool& spool);
/// The word for a job's state as people see it: with `held` and `paused`.
[[nodiscard]] std::string_view job_word(const spool::Spool& spool, const spool::Job& job);

/// Zeros for any but the running job.
[[nodiscard]] Progress progress_of(const spool::Spool& spool, const spool::Job& job);

}  // namespace qduino::web::api
