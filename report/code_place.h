// Where an address of this program is in the sources, from its debug lines: for a report that names
// the line of a sketch. libbacktrace reads them (I. L. Taylor; it comes with GCC).
#pragma once

#include <span>
#include <string>

namespace qduino::apps {

/// "blink.ino:12"; where the code is not in the sketch itself, its own place and then "called at
/// blink.ino:12". `stack`: return addresses, from the inside out. Where there are no lines: "an
/// unknown place". Allocates.
[[nodiscard]] std::string place_of(std::span<const void* const> stack);

}  // namespace qduino::apps
