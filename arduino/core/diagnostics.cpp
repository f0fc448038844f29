#include "arduino/core/diagnostics.h"

#include <atomic>
#include <cstdio>

namespace qduino::arduino {

namespace {

constexpr std::uint32_t kPrintedErrorsMax = 32;
std::atomic<ErrorHandler> error_handler{nullptr};
std::atomic<std::uint32_t> errors{0};

void print_error(std::uint32_t number, const char* call, int subject, const Error& error) {
    if (number > kPrintedErrorsMax) return;
    const auto text = error.message.view();
    std::fprintf(stderr, "sketch: %s(%d): %.*s%s\n", call, subject, static_cast<int>(text.size()),
                 text.data(),
                 number == kPrintedErrorsMax ? " (further errors are counted, not printed)" : "");
}

}  // namespace

ErrorHandler set_error_handler(ErrorHandler handler) { return error_handler.exchange(handler); }

void report_error(const char* call, int subject, const Error& error) {
    const std::uint32_t number = errors.fetch_add(1, std::memory_order_relaxed) + 1;
    if (const ErrorHandler handler = error_handler.load()) {
        handler(call, subject, error);
    } else {
        print_error(number, call, subject, error);
    }
}

bool succeeded(const char* call, int subject, const Result<void>& result) {
    if (!result.ok()) report_error(call, subject, result.error());
    return result.ok();
}

std::uint32_t error_count() { return errors.load(std::memory_order_relaxed); }

}  // namespace qduino::arduino
