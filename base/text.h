// One way to build a text. A real-time loop must not allocate, so it writes into a FixedString; a
// program may write into a std::string. Both take the same pieces, and none asks the locale:
//
//   text("the heater is at ", Fixed{celsius, 1}, " °C after ", 1500us)    a FixedString<236>
//   text<std::string>("line ", number, ": ", word)
//   write(out, "; ", name)                                               behind what `out` holds
#pragma once

#include <charconv>
#include <concepts>
#include <cstdint>
#include <string_view>

#include "base/fixed_string.h"
#include "base/time.h"

namespace qduino {

/// A number with `decimals` digits behind the point; never an exponent. For |value| < 1e15.
struct Fixed {
    double value = 0;
    int decimals = 2;
};

/// A number in the fewest digits that tell it apart: 150, 0.2, 1000000; beyond 1e15, and nearer to
/// 0 than 1e-6, with an exponent.
struct Shortest {
    double value = 0;
};

/// Appends what std::to_chars makes of `arguments`; "?" where that is too long.
template <typename Out, typename... Arguments>
void write_characters(Out& out, Arguments... arguments) {
    char digits[64];
    const auto [end, error] = std::to_chars(digits, digits + sizeof digits, arguments...);
    out.append(error == std::errc{} ? std::string_view{digits, static_cast<std::size_t>(end - digits)}
                                    : std::string_view{"?"});
}

template <typename Out>
void write_piece(Out& out, std::string_view piece) {
    out.append(piece);
}

template <typename Out>
void write_piece(Out& out, std::same_as<char> auto piece) {
    out.append(std::string_view{&piece, 1});
}

/// Decimal digits.
template <typename Out, std::integral Number>
requires(!std::same_as<Number, char> && !std::same_as<Number, bool>) void write_piece(Out& out,
                                                                                      Number number) {
    write_characters(out, number);
}

template <typename Out>
void write_piece(Out& out, Fixed number) {
    write_characters(out, number.value, std::chars_format::fixed, number.decimals);
}

template <typename Out>
void write_piece(Out& out, Shortest number) {
    const double size = number.value < 0 ? -number.value : number.value;
    const bool plain = (size >= 1e-6 && size < 1e15) || size == 0;
    write_characters(out, number.value, plain ? std::chars_format::fixed : std::chars_format::scientific);
}

/// In the largest unit in which it is at least 1 and three decimals say it exactly: "1.5 us",
/// "10.001 ms", "0 ns".
template <typename Out>
void write_piece(Out& out, Nanoseconds duration) {
    struct Unit {
        std::int64_t ns;
        std::string_view name;
    };
    constexpr Unit kUnits[] = {{1'000'000'000, " s"}, {1'000'000, " ms"}, {1000, " us"}, {1, " ns"}};
    const std::int64_t size = duration.count() < 0 ? -duration.count() : duration.count();
    const Unit* unit = kUnits;
    while (unit->ns > 1 && (size < unit->ns || size % (unit->ns / 1000) != 0)) ++unit;
    if (duration.count() < 0) write_piece(out, '-');
    write_characters(out, size / unit->ns);
    std::int64_t rest = size % unit->ns;
    if (rest != 0) write_piece(out, '.');
    for (std::int64_t place = unit->ns / 10; rest != 0; rest %= place, place /= 10)
        write_characters(out, rest / place);
    out.append(unit->name);
}

/// Appends the pieces to `out`, in order. A FixedString cuts what does not fit.
template <typename Out, typename... Pieces>
Out& write(Out& out, const Pieces&... pieces) {
    (write_piece(out, pieces), ...);
    return out;
}

/// The pieces as a text of their own.
template <typename Out = FixedString<236>, typename... Pieces>
[[nodiscard]] Out text(const Pieces&... pieces) {
    Out out;
    write(out, pieces...);
    return out;
}

}  // namespace qduino
