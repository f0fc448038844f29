// Reads the parameters of GET /api/v1/jobs behind the `?`.
#include <algorithm>
#include <array>

#include "base/whole_number.h"
#include "web/api/json.h"

namespace qduino::web::api {

namespace {

constexpr std::size_t kTextMaxBytes = 200;  // as long as a name may be

struct Word {
    std::string_view word;
    bool spool::JobQuery::*wanted;
};
constexpr std::array kWords{
    Word{"queued", &spool::JobQuery::waiting}, Word{"held", &spool::JobQuery::held},
    Word{"done", &spool::JobQuery::done},      Word{"cancelled", &spool::JobQuery::cancelled},
    Word{"failed", &spool::JobQuery::failed},
};

/// "queued,held": only these states. False: an unknown word.
bool read_states(std::string_view text, std::string_view running_word, spool::JobQuery& query) {
    query.waiting = query.held = query.printing = query.done = query.cancelled = query.failed = false;
    for (bool last = false; !last;) {
        last = text.find(',') == std::string_view::npos;
        const std::string_view word = take_until(text, ',');
        bool known = word == "printing" || word == "paused" || word == "uploading";
        query.printing = query.printing || word == running_word;
        for (const Word& each : kWords) {
            if (each.word != word) continue;
            query.*each.wanted = true;
            known = true;
        }
        if (!known) return false;
    }
    return true;
}

/// Reads one parameter into `query`. Unknown ones are left to others.
Result<void> read_parameter(std::string_view name, const std::string& value, std::string_view running_word,
                            spool::JobQuery& query) {
    if (name == "limit") {
        const std::optional<std::size_t> limit = whole_number<std::size_t>(value);
        if (!limit || *limit < 1 || *limit > spool::JobQuery::kLimitMax)
            return make_error(ErrorCode::out_of_range, "limit must be a whole number from 1 to 1000");
        query.limit = *limit;
    } else if (name == "before") {
        query.before = whole_number<std::int64_t>(value);
        if (!query.before || *query.before < 1)
            return make_error(ErrorCode::invalid_argument, "before must be a job's number");
    } else if (name == "state" && !value.empty()) {
        if (!read_states(value, running_word, query))
            return make_error(
                ErrorCode::invalid_argument,
                "state must be of queued, held, printing, paused, done, cancelled and failed, with commas "
                "between");
    } else if (name == "q") {
        query.text = value;
        if (value.size() > kTextMaxBytes || !spool::is_utf8(value))
            return make_error(ErrorCode::invalid_argument,
                              "q must be a part of a name: UTF-8, 200 bytes at most");
    }
    return {};
}

/// As a browser's form writes it: a `+` is a space.
std::optional<std::string> form_decoded(std::string_view text) {
    std::string spaced{text};
    std::replace(spaced.begin(), spaced.end(), '+', ' ');
    return percent_decoded(spaced);
}

}  // namespace

Result<spool::JobQuery> job_query_of(std::string_view parameters, std::string_view running_word) {
    spool::JobQuery query;
    while (!parameters.empty()) {
        std::string_view text = take_until(parameters, '&');
        const std::string_view name = take_until(text, '=');
        const std::optional<std::string> value = form_decoded(text);
        if (!value)
            return make_error(ErrorCode::invalid_argument,
                              "a parameter is malformed: % must stand before two hexadecimal digits");
        QDUINO_TRY(read_parameter(name, *value, running_word, query));
    }
    return query;
}

}  // namespace qduino::web::api
