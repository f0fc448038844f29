// Accept-Encoding and If-None-Match, as RFC 9110 has them.
#include "web/http/content_coding.h"

#include <gtest/gtest.h>

#include <random>
#include <string>

namespace qduino::web::content_coding_test {
namespace {

constexpr std::array<bool, kCodings> kAll{true, true, true};
constexpr std::array<bool, kCodings> kGzip{true, true, false};
constexpr std::array<bool, kCodings> kPlain{true, false, false};

struct Case {
    std::string_view accept;
    Coding of_all;
    Coding of_gzip;
};

TEST(ContentCoding, TheClientsWeightsDecideThenWhatIsSmaller) {
    const Coding identity = Coding::identity, gzip = Coding::gzip, brotli = Coding::brotli;
    for (const Case& each : std::initializer_list<Case>{
             {"", identity, identity},
             {"gzip, deflate, br", brotli, gzip},  // what browsers say
             {"gzip", gzip, gzip},
             {"GZIP", gzip, gzip},
             {"x-gzip", gzip, gzip},
             {"br", brotli, identity},
             {"deflate, zstd", identity, identity},
             {"*", brotli, gzip},
             {"gzip;q=1.0, br;q=0.9", gzip, gzip},
             {"gzip; q=0.5 , br;q=0.501", brotli, gzip},
             {"br;q=0, gzip", gzip, gzip},
             {"br;q=0, *", gzip, gzip},
             {"gzip;q=0", identity, identity},
             {"*;q=0", identity, identity},
             {"identity;q=0, gzip;q=0.1", gzip, gzip},
             {"identity, gzip;q=0.5", identity, identity},
             {"identity;q=0.5, gzip;q=0.5", gzip, gzip},
             {"gzip;q=0.001", gzip, gzip},
             {"gzip;q=nonsense", identity, identity},
             {"gzip;q=2", identity, identity},
             {"gzip;q=1.001", identity, identity},
             {"gzip;q=0.5555", identity, identity},
             {",, ;;, gzip ,", gzip, gzip},
             {"gzip;level=9;q=0.3", gzip, gzip},
             {"gzipp, bro", identity, identity},
         }) {
        EXPECT_EQ(choose_coding(each.accept, kAll), each.of_all) << each.accept;
        EXPECT_EQ(choose_coding(each.accept, kGzip), each.of_gzip) << each.accept;
        EXPECT_EQ(choose_coding(each.accept, kPlain), identity) << each.accept;
    }
}

TEST(ContentCoding, ATagIsFoundInAListByWeakComparison) {
    EXPECT_TRUE(names_etag("\"a\"", "\"a\""));
    EXPECT_TRUE(names_etag("\"b\", W/\"a\"", "\"a\""));
    EXPECT_TRUE(names_etag("*", "\"a\""));
    EXPECT_FALSE(names_etag("", "\"a\""));
    EXPECT_FALSE(names_etag("\"ab\", a, W/a", "\"a\""));
}

TEST(ContentCoding, AnyTextChoosesSomethingThatIsThere) {
    const std::string_view alphabet = "gzipbr*;q=01.,, \t\"W/identity";
    for (unsigned seed = 1; seed <= 2000; ++seed) {
        std::mt19937 random{seed};
        std::string text(random() % 40, ' ');
        for (char& c : text) c = alphabet[random() % alphabet.size()];
        EXPECT_NE(choose_coding(text, kGzip), Coding::brotli) << seed << ": " << text;
        static_cast<void>(names_etag(text, "\"a\""));
    }
}

}  // namespace
}  // namespace qduino::web::content_coding_test
