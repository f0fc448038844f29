// SHA-256 as bytes arrive, where there is no library for it: FIPS 180-4, 5.1.1 (padding), 5.3.3
// (initial value), 6.2.2 (computation).
//
//   bytes ─► blocks of 64 ─► compress: 64 rounds on 8 words ─► … ─► the 8 words are the hash
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace qduino {

class BareSha256 {
  public:
    void add(std::span<const char> bytes);
    /// 64 lower-case hexadecimal digits. Once.
    [[nodiscard]] std::string finish();

  private:
    void compress();

    std::array<std::uint32_t, 8> words_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<std::uint8_t, 64> block_{};
    std::uint64_t bytes_ = 0;  // ever added; of them the last bytes_ % 64 are in block_
};

}  // namespace qduino
