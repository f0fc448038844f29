#include "web/api/answers.h"

#include <array>
#include <utility>

namespace qduino::web::api {

bool fits_pattern(std::string_view pattern, const std::vector<std::string>& path,
                  std::vector<std::string>& arguments) {
    arguments.clear();
    bool rest = false;
    for (const std::string& segment : path) {
        if (rest) {  // a slash in what is left, decoded or not, is the handler's to judge
            arguments.back() += "/" + segment;
            continue;
        }
        if (pattern.empty()) return false;
        pattern.remove_prefix(1);  // the slash
        const std::string_view expected = pattern.substr(0, pattern.find('/'));
        pattern.remove_prefix(expected.size());
        rest = expected == kRest;
        if (rest || expected == "*") {
            if (segment.empty() && !rest) return false;
            arguments.push_back(segment);
        } else if (expected != segment) {
            return false;
        }
    }
    return pattern.empty();
}

namespace {

struct Answered {
    std::string_view word;
    int status;
};
/// Ordered as ErrorCode is.
constexpr std::array<Answered, 11> kErrors{{{"invalid_argument", 400},
                                            {"out_of_range", 422},
                                            {"not_found", 404},
                                            {"already_exists", 409},
                                            {"not_permitted", 409},
                                            {"unavailable", 503},
                                            {"timed_out", 503},
                                            {"corrupt", 500},
                                            {"unsupported", 415},
                                            {"faulted", 409},
                                            {"internal", 500}}};
static_assert(kErrors.size() == static_cast<std::size_t>(ErrorCode::internal) + 1);

}  // namespace

int status_of(ErrorCode code) { return kErrors.at(static_cast<std::size_t>(code)).status; }

std::string_view word_of(ErrorCode code) { return kErrors.at(static_cast<std::size_t>(code)).word; }

Response error_response(const Error& error) {
    return web::error_response(status_of(error.code), word_of(error.code), error.message.view());
}

Response answer(const Result<void>& result, Response ok) {
    return result.ok() ? std::move(ok) : error_response(result.error());
}

Response accepted() { return {.status = 202, .body = "{}"}; }

Response no_content() { return {.status = 204}; }

}  // namespace qduino::web::api
