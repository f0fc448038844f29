#include "web/api/route.h"
#include "base/words.h"

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

int status_of(ErrorCode code) {
    switch (code) {
        case ErrorCode::invalid_argument:
            return 400;
        case ErrorCode::out_of_range:
            return 422;
        case ErrorCode::not_found:
            return 404;
        case ErrorCode::already_exists:
            return 409;
        case ErrorCode::not_permitted:
            return 409;
        case ErrorCode::unavailable:
            return 503;
        case ErrorCode::timed_out:
            return 503;
        case ErrorCode::corrupt:
            return 500;
        case ErrorCode::unsupported:
            return 415;
        case ErrorCode::faulted:
            return 409;
        case ErrorCode::internal:
            return 500;
    }
    return 500;
}

std::string_view word_of(ErrorCode code) {
    static constexpr Words<ErrorCode::invalid_argument, ErrorCode::internal> kWords{
        "invalid_argument", "out_of_range", "not_found",   "already_exists", "not_permitted", "unavailable",
        "timed_out",        "corrupt",      "unsupported", "faulted",        "internal"};
    return kWords(code);
}

Response error_response(const Error& error) {
    return web::error_response(status_of(error.code), word_of(error.code), error.message.view());
}

Response answer(const Result<void>& result, Response ok) {
    return result.ok() ? std::move(ok) : error_response(result.error());
}

Response accepted() {
    Response response;
    response.status = 202;
    response.body = "{}";
    return response;
}

Response no_content() {
    Response response;
    response.status = 204;
    return response;
}

}  // namespace qduino::web::api
