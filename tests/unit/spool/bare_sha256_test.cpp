// Our own SHA-256 against the examples of FIPS 180-2, appendix B, and against libsodium's.
#include "base/sha256.h"

#include <gtest/gtest.h>

#include <random>

#include "spool/disk/sha256.h"

namespace qduino::bare_sha256_test {
namespace {

std::string hash_of(std::string_view text) {
    BareSha256 hash;
    hash.add({text.data(), text.size()});
    return hash.finish();
}

TEST(Sha256, TheStandardsExamples) {
    EXPECT_EQ(hash_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
    EXPECT_EQ(hash_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
              "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(Sha256, EveryLengthAroundABlockInAnyPiecesIsAsTheLibraryHasIt) {
    std::mt19937 random(20261123);
    for (std::size_t length = 0; length < 300; ++length) {
        std::string text(length, ' ');
        for (char& c : text) c = static_cast<char>(random());
        BareSha256 hash;
        for (std::string_view left = text; !left.empty();) {
            const std::string_view piece = left.substr(0, 1 + random() % 80);
            hash.add({piece.data(), piece.size()});
            left.remove_prefix(piece.size());
        }
        ASSERT_EQ(hash.finish(), spool::sha256_of(text)) << "length " << length;
    }
}

}  // namespace
}  // namespace qduino::bare_sha256_test
