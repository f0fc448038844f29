// The objects of the HTTP interface (docs/api.md) as JSON.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "spool/spool.h"
#include "web/http.h"

namespace qduino::web::api {

using Json = nlohmann::ordered_json;

/// Bytes that are no UTF-8 (a machine's message, say) become U+FFFD: an answer is always valid JSON.
[[nodiscard]] std::string text_of(const Json& json);
[[nodiscard]] Response json_response(const Json& json, int status = 200);
/// The body as an object; nothing when it is none.
[[nodiscard]] std::optional<Json> object_of(std::string_view body);

/// "2026-11-21T06:00:00Z"; null for 0.
[[nodiscard]] Json time_json(spool::UnixSeconds time_s);
[[nodiscard]] Json job_json(const spool::Spool& spool, const spool::Job& job);

/// Where a queued job stands.
struct Place {
    std::size_t position = 0;  ///< 1-based
    std::optional<double>
        starts_in_s;  ///< if every estimate holds; nothing when one is unknown, or it is held
};
/// Places of all queued jobs, in the order of the queue.
[[nodiscard]] std::vector<Place> places_of(const spool::Spool& spool);
/// {"jobs":[…],"queue":{…}}
[[nodiscard]] Json jobs_json(const spool::Spool& spool);
[[nodiscard]] Json status_json(const spool::Spool& spool);
/// The word of `state` in the status object, "disconnected" included.
[[nodiscard]] std::string_view machine_word(const spool::MachineView& machine);
/// The word of a job's state as people see it: with `held` and `paused`.
[[nodiscard]] std::string_view job_word(const spool::Spool& spool, const spool::Job& job);

/// How far the running copy of `job` is; zeros for any other.
struct Progress {
    std::uint64_t bytes = 0;
    double fraction = 0;  ///< 0…1
    double elapsed_s = 0;
    double remaining_s = 0;
};
[[nodiscard]] Progress progress_of(const spool::Spool& spool, const spool::Job& job);

}  // namespace qduino::web::api
