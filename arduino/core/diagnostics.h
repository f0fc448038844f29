// Reports the errors of the Arduino face: its functions return void, while the port's return a
// Result.
#pragma once

#include <cstdint>

#include "base/result.h"

namespace qduino::arduino {

/// Called with the name of the Arduino call that failed, its pin (or bus address), and the error.
/// May run in any loop: it must not block.
using ErrorHandler = void (*)(const char* call, int subject, const Error& error);

/// Installs `handler` (null restores the default: the first 32 errors go to stderr, the others are
/// counted).
ErrorHandler set_error_handler(ErrorHandler handler);

/// Reports `error`; counts it always.
void report_error(const char* call, int subject, const Error& error);
/// True when `result` holds; reports it otherwise.
bool succeeded(const char* call, int subject, const Result<void>& result);
/// Errors reported since the program began.
std::uint32_t error_count();

/// Reports an error in `pieces` of text (base/text.h): false.
template <typename... Pieces>
bool refuse(const char* call, int subject, ErrorCode code, const Pieces&... pieces) {
    report_error(call, subject, make_error(code, pieces...));
    return false;
}

}  // namespace qduino::arduino
