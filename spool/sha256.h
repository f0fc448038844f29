// SHA-256 (FIPS 180-4), by libsodium, as bytes arrive.
#pragma once

#include <sodium/crypto_hash_sha256.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace qduino::spool {

class Sha256 {
  public:
    Sha256() { crypto_hash_sha256_init(&state_); }
    void add(std::span<const char> bytes) {
        crypto_hash_sha256_update(&state_, reinterpret_cast<const unsigned char*>(bytes.data()),
                                  bytes.size());
    }
    /// 64 lower-case hexadecimal digits. Once.
    [[nodiscard]] std::string finish() {
        std::array<unsigned char, crypto_hash_sha256_BYTES> digest{};
        crypto_hash_sha256_final(&state_, digest.data());
        constexpr std::string_view kDigits = "0123456789abcdef";
        std::string text;
        for (const unsigned char byte : digest) {
            text += kDigits[byte >> 4];
            text += kDigits[byte & 15];
        }
        return text;
    }

  private:
    crypto_hash_sha256_state state_;
};

inline std::string sha256_of(std::string_view text) {
    Sha256 hash;
    hash.add({text.data(), text.size()});
    return hash.finish();
}

}  // namespace qduino::spool
