#include "web/api/route.h"

namespace qduino::web::api {

namespace {

/// True when `path` fits `pattern`; fills `arguments`.
bool fits(std::string_view pattern, const std::vector<std::string>& path,
          std::vector<std::string>& arguments) {
    arguments.clear();
    for (const std::string& segment : path) {
        if (pattern.empty()) return false;
        pattern.remove_prefix(1);  // the slash
        const std::string_view expected = pattern.substr(0, pattern.find('/'));
        pattern.remove_prefix(expected.size());
        if (expected == "*") {
            if (segment.empty()) return false;
            arguments.push_back(segment);
        } else if (expected != segment) {
            return false;
        }
    }
    return pattern.empty();
}

}  // namespace

Match find_route(const RequestHead& head) {
    Match match;
    const Method wanted = head.method == Method::head ? Method::get : head.method;
    for (const auto& routes : {job_routes(), machine_routes(), octoprint_routes(), prusalink_routes()}) {
        for (const Route& route : routes) {
            std::vector<std::string> arguments;
            if (!fits(route.pattern, head.path, arguments)) continue;
            match.path_known = true;
            if (route.method != wanted) continue;
            match.handler = route.handler;
            match.arguments = std::move(arguments);
            return match;
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
    switch (code) {
        case ErrorCode::invalid_argument:
            return "invalid_argument";
        case ErrorCode::out_of_range:
            return "out_of_range";
        case ErrorCode::not_found:
            return "not_found";
        case ErrorCode::already_exists:
            return "already_exists";
        case ErrorCode::not_permitted:
            return "not_permitted";
        case ErrorCode::unavailable:
            return "unavailable";
        case ErrorCode::timed_out:
            return "timed_out";
        case ErrorCode::corrupt:
            return "corrupt";
        case ErrorCode::unsupported:
            return "unsupported";
        case ErrorCode::faulted:
            return "faulted";
        case ErrorCode::internal:
            return "internal";
    }
    return "internal";
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
