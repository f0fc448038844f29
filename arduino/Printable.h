// Printable: what print() can be given besides text and numbers: a thing that prints itself.
#pragma once

#include <cstddef>

class Print;

class Printable {
  public:
    virtual ~Printable() = default;
    /// Prints itself to `out`; returns the bytes written.
    virtual std::size_t printTo(Print& out) const = 0;
};
