// Copies bytes through a mailbox as relaxed atomic words. A reader that looks while a writer writes
// reads nonsense, and the sequence number tells it to throw that away; but it never meets undefined
// behaviour (pins_layout.h, Mailbox).
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <span>

namespace qduino::board {

/// `words` must hold all of `bytes`.
inline void store_words(std::span<std::atomic<std::uint64_t>> words, std::span<const std::uint8_t> bytes) {
    for (std::size_t at = 0, i = 0; at < bytes.size(); at += sizeof(std::uint64_t), ++i) {
        std::uint64_t word = 0;
        std::memcpy(&word, bytes.data() + at, std::min(sizeof word, bytes.size() - at));
        words[i].store(word, std::memory_order_release);
    }
}

inline void load_words(std::span<const std::atomic<std::uint64_t>> words, std::span<std::uint8_t> bytes) {
    for (std::size_t at = 0, i = 0; at < bytes.size(); at += sizeof(std::uint64_t), ++i) {
        const std::uint64_t word = words[i].load(std::memory_order_acquire);
        std::memcpy(bytes.data() + at, &word, std::min(sizeof word, bytes.size() - at));
    }
}

}  // namespace qduino::board
