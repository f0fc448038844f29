// What the loader was told on its command line: words "name=value" that blanks separate.
#pragma once

#include <string>
#include <string_view>

namespace qduino::arduino::metal {

/// First of all; `words` stays where it is.
void keep_loader_words(std::string_view words);
/// The value of the first word of this name; empty: there is none.
[[nodiscard]] std::string loader_word(std::string_view name);

}  // namespace qduino::arduino::metal
