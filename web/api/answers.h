// What every service with this interface (docs/api.md) answers with, and how a path is matched.
// Values alone: no sockets, no spool.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "web/http/http.h"

namespace qduino::web::api {

/// Ends a pattern: all that is left of a path.
inline constexpr std::string_view kRest = "**";

/// True when `path` fits `pattern` (Route::pattern); fills `arguments` with what its `*`s stand
/// for.
[[nodiscard]] bool fits_pattern(std::string_view pattern, const std::vector<std::string>& path,
                                std::vector<std::string>& arguments);

/// The HTTP status for an operating error.
[[nodiscard]] int status_of(ErrorCode code);
[[nodiscard]] std::string_view word_of(ErrorCode code);
[[nodiscard]] Response error_response(const Error& error);
/// The same for an error in `pieces` of text (base/text.h).
template <typename... Pieces>
[[nodiscard]] Response refused(ErrorCode code, const Pieces&... pieces) {
    return error_response(make_error(code, pieces...));
}
/// `ok` when the result is good, else its error.
[[nodiscard]] Response answer(const Result<void>& result, Response ok);
[[nodiscard]] Response accepted();
[[nodiscard]] Response no_content();

}  // namespace qduino::web::api
