// Numbers and tables for people: three significant digits, in the unit that keeps them short.
// Programs get exact numbers, in JSON.
#pragma once

#include <string>

#include "base/text.h"
#include "base/time.h"

namespace qduino::apps {

/// "734 ns", "12.7 us", "186 ms", "1.01 s", "30 ms". Rounded; for exact ones see
/// text() of base/text.h.
[[nodiscard]] std::string human_duration(Nanoseconds duration);
/// "1 loop", "3 loops".
[[nodiscard]] std::string counted(long long count, const std::string& what);

/// `piece` (base/text.h) in a column of a table: at least `width` wide, at its right end; with a
/// negative width at its left end.
template <typename Piece>
[[nodiscard]] std::string column(const Piece& piece, int width) {
    std::string out = text<std::string>(piece);
    const auto wide = static_cast<std::size_t>(width < 0 ? -width : width);
    if (out.size() < wide) out.insert(width < 0 ? out.size() : 0, wide - out.size(), ' ');
    return out;
}

}  // namespace qduino::apps
