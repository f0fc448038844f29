// Names as numbers of fixed size, to tell them apart.
//
// Slicers put what tells two copies apart at the end of a long name. So a name that is cut is no
// identity: `…_copy_0` and `…_copy_1` would be one. A number is made of the whole name instead.
//
// Two sums of 64 bits go over the bytes: FNV-1a, and one with another factor that turns as it goes.
// Each step of either can be undone, so two names of the same length that differ in one place never
// agree. Any other two agree by chance only, once in 2^128. Source of the first: Fowler, Noll, Vo,
// "The FNV Non-Cryptographic Hash Algorithm" (IETF draft-eastlake-fnv).
#pragma once

#include <bit>
#include <cstdint>
#include <string_view>

#include "printer/gcode/text.h"

namespace qduino::printer::gcode {

struct NameKey {
    std::uint64_t first = 0xCBF29CE484222325;
    std::uint64_t second = 0x9E3779B97F4A7C15;

    constexpr void take(char c) {
        const auto byte = static_cast<unsigned char>(c);
        first = (first ^ byte) * 0x100000001B3;
        second = std::rotl((second ^ byte) * 0xD6E8FEB86659FD93, 29);
    }
    friend constexpr bool operator==(const NameKey&, const NameKey&) = default;
};

/// A name as it is written.
constexpr NameKey key_of(std::string_view name) {
    NameKey key;
    for (const char c : name) key.take(c);
    return key;
}

/// A name that is the same in capitals (A to Z; other letters are as they are written).
constexpr NameKey key_in_any_case(std::string_view name) {
    NameKey key;
    for (const char c : name) key.take(to_upper(c));
    return key;
}

}  // namespace qduino::printer::gcode
