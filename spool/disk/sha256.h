// SHA-256 (FIPS 180-4) as bytes arrive, and random names, by libsodium.
#pragma once

#include <sodium/crypto_hash_sha256.h>
#include <sodium/randombytes.h>
#include <sodium/utils.h>

#include <array>
#include <span>
#include <string>
#include <string_view>

namespace qduino::spool {

/// Two lower-case digits a byte.
inline std::string hexadecimal(std::span<const unsigned char> bytes) {
    std::string text(2 * bytes.size() + 1, '\0');  // sodium ends it with a zero
    sodium_bin2hex(text.data(), text.size(), bytes.data(), bytes.size());
    text.pop_back();
    return text;
}

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
        return hexadecimal(digest);
    }

  private:
    crypto_hash_sha256_state state_;
};

inline std::string sha256_of(std::string_view text) {
    Sha256 hash;
    hash.add({text.data(), text.size()});
    return hash.finish();
}

/// 32 random hexadecimal digits.
inline std::string random_name() {
    std::array<unsigned char, 16> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    return hexadecimal(bytes);
}

}  // namespace qduino::spool
