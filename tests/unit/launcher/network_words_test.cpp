#include "apps/launcher/network_words.h"

#include <gtest/gtest.h>

#include <string>

namespace qduino::launcher::network_words_test {
namespace {

TEST(NetworkWords, TellTheNameTheCodeAndTheFingerprint) {
    const std::string half = "00:11:22:33:44:55:66:77:88:99:AA:BB:CC:DD:EE:";
    const std::string line = "https://192.168.1.5:8080/#key=abc " + half + "FF:" + half + "0F\n";
    EXPECT_EQ(network_words(line, "workshop", 8080, false),
              "  Name   https://workshop.local:8080/#key=abc\n\n"
              "  The certificate's SHA-256, which a browser shows behind its warning:\n  " +
                  half + "FF:\n  " + half + "0F\n\n");
    EXPECT_EQ(network_words("http://10.0.0.1:80/\n", "w", 80, false), "  Name   https://w.local:80/\n\n");
    EXPECT_EQ(network_words("http://10.0.0.1:80/\n", "", 80, false), "");
    EXPECT_NE(network_words(line, "", 8080, true).find("█"), std::string::npos);
}

}  // namespace
}  // namespace qduino::launcher::network_words_test
