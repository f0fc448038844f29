// A route: a method and a path pattern, and the small function that answers. Called on the spool's
// thread, one at a time.
#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "printer/machine_config.h"
#include "spool/spool.h"
#include "web/http.h"

namespace qduino::web::api {

/// Everything a handler may use.
struct Context {
    spool::Spool& spool;
    printer::MachineConfig machine;  ///< for refusing early, and for what other programs ask
    std::string config_json;         ///< answer to GET /api/v1/config
    std::string version;
    /// Judges one line of G-code before it is sent; empty: the machine alone judges.
    std::function<Result<void>(std::string_view)> check_line;
};

struct Call {
    const Request& request;
    std::vector<std::string> arguments;  ///< what the `*`s of the pattern stood for
    spool::UnixSeconds now_s = 0;
};

using Handler = Response (*)(Context&, const Call&);

struct Route {
    Method method;
    std::string_view pattern;  ///< "/api/v1/jobs/*/start"; `*` is one whole segment
    Handler handler;
};

/// The routes of each dialect, in files of their own.
[[nodiscard]] std::span<const Route> job_routes();
[[nodiscard]] std::span<const Route> machine_routes();
[[nodiscard]] std::span<const Route> octoprint_routes();
[[nodiscard]] std::span<const Route> prusalink_routes();

struct Match {
    Handler handler = nullptr;  ///< null: no such path, or no such method on it
    std::vector<std::string> arguments;
    bool path_known = false;
};
/// HEAD matches as GET does.
[[nodiscard]] Match find_route(const RequestHead& head);

/// The HTTP status for an operating error.
[[nodiscard]] int status_of(ErrorCode code);
[[nodiscard]] std::string_view word_of(ErrorCode code);
[[nodiscard]] Response error_response(const Error& error);
/// `ok` when the result is good, else its error.
[[nodiscard]] Response answer(const Result<void>& result, Response ok);
[[nodiscard]] Response accepted();
[[nodiscard]] Response no_content();

}  // namespace qduino::web::api
