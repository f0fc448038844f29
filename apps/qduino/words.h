// The words of a command line, in order: the program first.
#pragma once

#include <string>
#include <vector>

namespace qduino::apps {

using Words = std::vector<std::string>;

inline void append(Words& words, const Words& more) { words.insert(words.end(), more.begin(), more.end()); }

}  // namespace qduino::apps
