// The objects of the HTTP interface (docs/api.md) as JSON, as far as they are made of values alone:
// the link's status, and a job. json.h adds what only the spool knows.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "printer/link/layout.h"
#include "spool/job.h"
#include "web/http/http.h"

/// A value that is not there is null.
template <typename Value>
struct nlohmann::adl_serializer<std::optional<Value>> {
    static void to_json(auto& json, const std::optional<Value>& value) {
        if (value) {
            json = *value;
        } else {
            json = nullptr;
        }
    }
};

namespace qduino::web::api {

using Json = nlohmann::ordered_json;

/// Bytes that are no UTF-8 (a machine's message, say) become U+FFFD, so an answer is always valid
/// JSON.
[[nodiscard]] std::string text_of(const Json& json);
[[nodiscard]] Response json_response(const Json& json, int status = 200);
/// The body as an object; nothing when it is not one.
[[nodiscard]] std::optional<Json> object_of(std::string_view body);
/// The progress of a running copy.
struct Progress {
    std::uint64_t bytes = 0;
    double fraction = 0;  ///< of the copy's time, 0…1
    double elapsed_s = 0;
    std::optional<double> remaining_s = 0;  ///< nothing while a running copy gives no estimate yet
};

/// The word of `state` in the status object.
[[nodiscard]] std::string_view machine_word(printer::link::MachineState state);
/// The word of `activity` in the status object; null for `none`, and for what is none of them.
[[nodiscard]] Json activity_word(printer::link::Activity activity);
/// The status object, as far as the link tells it.
[[nodiscard]] Json machine_json(const printer::link::JobStatus& job,
                                const printer::link::MotionStatus& motion,
                                const printer::link::HeatStatus& heat);
/// A job without its place and its times: these are null. `word`: its state as people see it.
[[nodiscard]] Json job_json(const spool::Job& job, std::string_view word, const Progress& progress);
[[nodiscard]] Json progress_json(const Progress& progress);
[[nodiscard]] Json text_or_null(std::string_view text);

}  // namespace qduino::web::api
