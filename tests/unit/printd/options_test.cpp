#include "apps/printd/options.h"

#include <gtest/gtest.h>

namespace qduino::printd::options_test {
namespace {

using apps::ServiceOptions;
using apps::words_of;

std::optional<Options> parse(std::vector<std::string> arguments, int& status) {
    arguments.insert(arguments.begin(), {"printd", "--state", "s", "--link", "l"});
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    ::testing::internal::CaptureStderr();
    ::testing::internal::CaptureStdout();
    auto options = parse_options(static_cast<int>(pointers.size()), pointers.data(), status);
    static_cast<void>(::testing::internal::GetCapturedStdout());
    static_cast<void>(::testing::internal::GetCapturedStderr());
    return options;
}

TEST(Options, TheDefaultsAreTheSafeOnes) {
    int status = 0;
    const auto options = parse({}, status);
    ASSERT_TRUE(options.has_value());
    EXPECT_EQ(options->address, "127.0.0.1");
    EXPECT_TRUE(options->authentication);
    EXPECT_EQ(options->after_failure, "hold");
    EXPECT_TRUE(options->confirm_bed);
    EXPECT_EQ(options->keep_jobs, 100'000);
    EXPECT_EQ(options->keep_days, 0);
    EXPECT_EQ(options->store_max_mib, 0u);
    EXPECT_FALSE(options->recover);
    EXPECT_FALSE(options->print_link);
}

TEST(Options, ListenTakesAddressAndPort) {
    int status = 0;
    EXPECT_EQ(parse({"--listen", "192.168.1.2:81"}, status)->address, "192.168.1.2");
    EXPECT_EQ(parse({"--listen", "192.168.1.2:81"}, status)->port, 81);
    EXPECT_EQ(parse({"--listen", "[::1]:82"}, status)->address, "::1");
    EXPECT_EQ(parse({"--listen", "83"}, status)->port, 83);
    for (const char* bad : {"", ":80", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:70000", "127.0.0.1:-1"}) {
        EXPECT_FALSE(parse({"--listen", bad}, status).has_value()) << bad;
        EXPECT_EQ(status, 2) << bad;
    }
}

TEST(Options, WhatIsWrongOrMissingIsRefused) {
    int status = 0;
    EXPECT_FALSE(parse({"--after-failure", "explode"}, status).has_value());
    EXPECT_FALSE(parse({"--upload-limit-mib", "0"}, status).has_value());
    EXPECT_FALSE(parse({"--keep-jobs", "-1"}, status).has_value());
    EXPECT_FALSE(parse({"--keep-days", "x"}, status).has_value());
    EXPECT_FALSE(parse({"--store-limit-mib", "-5"}, status).has_value());
    EXPECT_FALSE(parse({"--nonsense"}, status).has_value());
    EXPECT_FALSE(parse({"--help"}, status).has_value());
    EXPECT_EQ(status, 0);
}

TEST(Options, WhatIsForPeopleIsHandedOnWordForWord) {
    int status = 0;
    const auto given = parse({"--name",
                              "printer-2",
                              "--allow-host",
                              "print.example",
                              "--allow-host",
                              "b",
                              "--trust-proxy",
                              "127.0.0.1",
                              "--trust-proxy",
                              "fd00::1",
                              "--tls-certificate",
                              "c",
                              "--tls-key",
                              "k",
                              "--upload-limit-mib",
                              "5",
                              "--after-failure",
                              "continue",
                              "--no-confirm-bed",
                              "--keep-jobs",
                              "7",
                              "--keep-days",
                              "8",
                              "--store-limit-mib",
                              "9"},
                             status);
    ASSERT_TRUE(given.has_value());
    EXPECT_NE(static_cast<const ServiceOptions&>(*given), ServiceOptions{});
    const auto again = parse(words_of(*given), status);
    ASSERT_TRUE(again.has_value());
    EXPECT_EQ(static_cast<const ServiceOptions&>(*again), static_cast<const ServiceOptions&>(*given));
    EXPECT_EQ(static_cast<const ServiceOptions&>(*parse(words_of({}), status)), ServiceOptions{});
}

TEST(Options, WhatCannotBeReachedOrBelievedIsRefused) {
    int status = 0;
    for (const char* name : {"a b", "a.local", "-a", "a_b"})
        EXPECT_FALSE(parse({"--name", name}, status).has_value()) << name;
    for (const char* proxy : {"proxy", "127.0.0.1:80", "10.0.0.0/8"})
        EXPECT_FALSE(parse({"--trust-proxy", proxy}, status).has_value()) << proxy;
    EXPECT_FALSE(parse({"--tls-certificate", "c"}, status).has_value());
    EXPECT_FALSE(parse({"--tls-key", "k"}, status).has_value());
    EXPECT_EQ(status, 2);
}

TEST(Options, ToRecoverNeedsNoLinkToServeDoes) {
    int status = 0;
    const auto parse_only = [&](std::vector<const char*> line) {
        ::testing::internal::CaptureStderr();
        const auto options =
            parse_options(static_cast<int>(line.size()), const_cast<char**>(line.data()), status);
        static_cast<void>(::testing::internal::GetCapturedStderr());
        return options;
    };
    EXPECT_TRUE(parse_only({"printd", "--state", "s", "--recover"})->recover);
    EXPECT_FALSE(parse_only({"printd", "--state", "s"}).has_value());
    EXPECT_EQ(status, 2);
}

TEST(Options, FlagsAreUnderstood) {
    int status = 0;
    const auto options =
        parse({"--no-auth", "--no-confirm-bed", "--print-link", "--after-failure", "continue", "--allow-host",
               "a", "--allow-host", "b", "--upload-limit-mib", "5"},
              status);
    ASSERT_TRUE(options.has_value());
    EXPECT_FALSE(options->authentication);
    EXPECT_FALSE(options->confirm_bed);
    EXPECT_TRUE(options->print_link);
    EXPECT_EQ(options->after_failure, "continue");
    EXPECT_EQ(options->hosts.size(), 2u);
    EXPECT_EQ(options->upload_max_mib, 5u);
}

}  // namespace
}  // namespace qduino::printd::options_test
