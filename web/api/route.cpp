#include "web/api/route.h"

namespace qduino::web::api {

namespace {

constexpr std::string_view kRest = "**";

/// True when `path` fits `pattern`; fills `arguments`.
bool fits(std::string_view pattern, const std::vector<std::string>& path,
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

}  // namespace

std::array<std::span<const Route>, 5> all_routes() {
    return {job_routes(), machine_routes(), octoprint_routes(), prusalink_routes(), service_routes()};
}

Match find_route(const RequestHead& head) {
    Match match;
    for (const std::span<const Route> routes : all_routes()) {
        for (const Route& route : routes) {
            const bool head_of_get = head.method == Method::head && route.body != Body::live;
            const bool wanted = route.method == (head_of_get ? Method::get : head.method);
            std::vector<std::string> arguments;
            // For another method any name would be a known path.
            if (!wanted && route.pattern.ends_with(kRest)) continue;
            if (!fits(route.pattern, head.path, arguments)) continue;
            match.path_known = true;
            if (route.guard == Guard::none) match.guard = Guard::none;
            if (!wanted) continue;
            return {&route, std::move(arguments), true, route.guard};
        }
    }
    return match;
}

namespace {

struct Answered {
    std::string_view word;
    int status;
};
/// In the order of ErrorCode.
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

Result<void> send_checked(Context& context, const std::vector<std::string>& lines) {
    if (context.check_line)
        for (const std::string& line : lines) QDUINO_TRY(context.check_line(line));
    return context.spool.gcode(lines);
}

Response accepted() { return {.status = 202, .body = "{}"}; }

Response no_content() { return {.status = 204}; }

}  // namespace qduino::web::api
