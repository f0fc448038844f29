// Which known word was meant by a wrong one.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace qduino::apps {

/// Letters to be added, left out, exchanged, or swapped with their neighbour to make `b` of `a`:
/// the optimal string alignment distance (Damerau, 1964, each place edited once).
[[nodiscard]] int edit_distance(std::string_view a, std::string_view b);

/// The nearest of `known`: with at most one slip for each three letters, or the only one that
/// begins with `word`. Empty: none.
[[nodiscard]] std::string nearest(std::string_view word, std::span<const std::string> known);

}  // namespace qduino::apps
