// Printable: a thing that prints itself, so that print() takes it as it takes text and numbers.
#pragma once

#include <cstddef>

class Print;

class Printable {
  public:
    virtual ~Printable() = default;
    /// Prints itself to `out`; returns the bytes written.
    virtual std::size_t printTo(Print& out) const = 0;
};

namespace arduino {
using ::Printable;
}  // namespace arduino
