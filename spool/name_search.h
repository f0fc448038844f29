// Finds jobs by a part of their name, in any case.
#pragma once

#include <string>
#include <string_view>

namespace qduino::spool {

/// `text` in lower case: ASCII, Latin-1 and Extended-A, Greek and Cyrillic (Unicode's simple
/// mappings). Everything else, and bytes that are no UTF-8, stay as they are. Any thread.
[[nodiscard]] std::string folded(std::string_view text);

/// True when `name` holds `folded_part`, which folded() made. An empty part is in every name.
[[nodiscard]] bool name_holds(std::string_view name, std::string_view folded_part);

}  // namespace qduino::spool
