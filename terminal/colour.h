// Colours of a terminal, where they are wanted: the meaning never hangs on one.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace qduino::apps {

/// What a piece of text is about. The colours are those of the pictures (report/picture/page.h), as
/// near as a terminal's 256 come.
enum class Tone : std::uint8_t { plain, loop, io, throttled, bad, good };

/// `descriptor` is a terminal that shows colours ($TERM is not "dumb"), and nobody said $NO_COLOR
/// (no-color.org: set, and not empty).
[[nodiscard]] bool wants_colour(int descriptor);

/// `words` in the colour of `tone`; as they are when it is plain, or nothing is wanted.
[[nodiscard]] std::string painted(std::string_view words, Tone tone, bool wanted);

/// `text` with the words for outcomes painted: admitted, and REFUSED, refused, FAILED, DIED,
/// OVERRUNs.
[[nodiscard]] std::string with_outcomes(std::string_view text, bool wanted);

/// Columns that `line` takes on a terminal: characters of UTF-8, without colours.
[[nodiscard]] std::size_t columns_of(std::string_view line);

}  // namespace qduino::apps
