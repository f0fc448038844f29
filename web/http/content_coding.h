// Chooses the coding of a body for a client, and whether it has the body already: Accept-Encoding
// and If-None-Match. Source: RFC 9110 §12.5.3, §12.4.2 (weights), §13.1.2. Hostile input: a
// malformed element counts as absent.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

namespace qduino::web {

enum class Coding : std::uint8_t { identity, gzip, brotli };
inline constexpr std::size_t kCodings = 3;

/// "br", "gzip", "identity".
[[nodiscard]] std::string_view word_of(Coding coding);

/// The best of the codings that are `there` (by index of Coding; identity always is). The client's
/// weights decide, then the size: brotli, gzip. A client that refuses everything gets identity:
/// bytes help it more than an error.
[[nodiscard]] Coding choose_coding(std::string_view accept_encoding, const std::array<bool, kCodings>& there);

/// True when a list of entity tags names `etag`, by weak comparison; `*` names every one.
[[nodiscard]] bool names_etag(std::string_view if_none_match, std::string_view etag);

}  // namespace qduino::web
