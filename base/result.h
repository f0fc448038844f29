// An operating error as a value: bounded text, without a heap, that says what was wrong, where, and
// what to do.
#pragma once

#include <optional>
#include <type_traits>
#include <utility>
#include <variant>

#include "base/contract.h"
#include "base/fixed_string.h"
#include "base/text.h"

namespace qduino {

/// The broad class of an error, for a caller that decides by it. The text is for people.
enum class ErrorCode : std::uint8_t {
    invalid_argument,  ///< the input is malformed or out of range; nothing was changed
    out_of_range,      ///< a machine limit (bounds, temperature, rate) would be broken
    not_found,
    already_exists,
    not_permitted,  ///< the system or the key does not allow it
    unavailable,    ///< not now: full, busy, not connected; may be tried again
    timed_out,
    corrupt,      ///< stored or received bytes fail their check
    unsupported,  ///< known, but not done by this build or board
    faulted,      ///< hardware fault: sensor, heater, endstop
    internal,
};

/// `message` names what was wrong, where, and what to do.
struct Error {
    ErrorCode code = ErrorCode::internal;
    FixedString<236> message;
};

/// A value, or an Error. Reading the wrong side is a broken contract.
template <typename T>
class [[nodiscard]] Result {
  public:
    Result(T value) : state_(std::in_place_index<0>, std::move(value)) {}      // NOLINT: implicit by design
    Result(Error error) : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT
    [[nodiscard]] bool ok() const { return state_.index() == 0; }
    explicit operator bool() const { return ok(); }
    T& value() & {
        QDUINO_EXPECT(ok());
        return *std::get_if<0>(&state_);
    }
    const T& value() const& {
        QDUINO_EXPECT(ok());
        return *std::get_if<0>(&state_);
    }
    T&& value() && { return std::move(value()); }
    T& operator*() & { return value(); }
    const T& operator*() const& { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    [[nodiscard]] const Error& error() const {
        QDUINO_EXPECT(!ok());
        return *std::get_if<1>(&state_);
    }

  private:
    std::variant<T, Error> state_;
};

/// Success, or an Error.
template <>
class [[nodiscard]] Result<void> {
  public:
    Result() = default;
    Result(Error error) : error_(std::move(error)) {}  // NOLINT: implicit by design
    [[nodiscard]] bool ok() const { return !error_; }
    explicit operator bool() const { return ok(); }
    [[nodiscard]] const Error& error() const {
        QDUINO_EXPECT(!ok());
        return *error_;
    }

  private:
    std::optional<Error> error_;  // success writes none of its bytes: it is far more frequent
};

/// `pieces` as base/text.h takes them: make_error(ErrorCode::not_found, "no job ", id).
template <typename... Pieces>
[[nodiscard]] Error make_error(ErrorCode code, const Pieces&... pieces) {
    Error error{code, {}};
    write(error.message, pieces...);
    return error;
}

}  // namespace qduino

/// Hands an error of `expression`, a Result, to the caller of this function; its value is dropped.
#define QDUINO_TRY(expression)                                          \
    do {                                                                \
        if (auto tried_ = (expression); !tried_) return tried_.error(); \
    } while (false)

/// Hands an error of `expression` to the caller of this function, or gives its value to
/// `declaration`: QDUINO_TRY_ASSIGN(const auto file, open(path)). Two statements: not for the body
/// of an `if` without braces.
#define QDUINO_TRY_ASSIGN(declaration, expression) \
    QDUINO_TRY_ASSIGN_TO(declaration, expression, QDUINO_TRY_NAME(tried_, __LINE__))
#define QDUINO_TRY_ASSIGN_TO(declaration, expression, name) \
    auto name = (expression);                               \
    if (!name) return name.error();                         \
    declaration = std::move(name).value()
#define QDUINO_TRY_NAME(stem, line) QDUINO_TRY_JOIN(stem, line)
#define QDUINO_TRY_JOIN(stem, line) stem##line
