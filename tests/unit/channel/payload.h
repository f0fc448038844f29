// A value that shows whether it arrived whole: its words follow from its number, and a checksum
// closes it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace qduino::channel {

template <std::size_t Words>
struct Payload {
    std::uint64_t number = 0;
    std::array<std::uint64_t, Words> words{};
    std::uint64_t checksum = 0;

    static constexpr std::uint64_t word(std::uint64_t number, std::size_t i) {
        return (number + i) * 0x9e3779b97f4a7c15u;
    }
    static Payload of(std::uint64_t number) {
        Payload payload;
        payload.number = number;
        payload.checksum = number;
        for (std::size_t i = 0; i < Words; ++i) payload.checksum ^= payload.words[i] = word(number, i);
        return payload;
    }
    [[nodiscard]] bool whole() const {
        std::uint64_t sum = number;
        for (std::size_t i = 0; i < Words; ++i) {
            if (words[i] != word(number, i)) return number == 0 && checksum == 0 && words[i] == 0;
            sum ^= words[i];
        }
        return sum == checksum;
    }
};

}  // namespace qduino::channel
