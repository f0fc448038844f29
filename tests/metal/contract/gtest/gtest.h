// As much of GoogleTest as the contract suite uses, for a machine without a system: GoogleTest asks
// for files, threads and streams. The suite is compiled as it is, against this header in the place
// of <gtest/gtest.h>, so the names are GoogleTest's.
//
//   TYPED_TEST_P … REGISTER_… INSTANTIATE_… ─► testing::cases(): names and bodies, in order
//   EXPECT_… fails ─► words on the serial line, one more failure;   ASSERT_… also returns
#pragma once

#include <atomic>
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include "base/text.h"
#include "board/metal/panic.h"

namespace testing {

class Test {};

struct Case {
    const char* name;
    void (*run)();
};
/// The cases of the one suite that is instantiated.
std::span<const Case> cases();

/// The failures of the one case that a machine runs. Threads count them; the host reads the number
/// when they have ended.
inline std::atomic<int> failures{0};

/// What `<<` adds to a failure.
class Message {
  public:
    template <typename Piece>
    Message& operator<<(const Piece& piece) {
        qduino::write(words_, piece);
        return *this;
    }
    [[nodiscard]] const std::string& words() const { return words_; }

  private:
    std::string words_;
};

/// A failed expectation; the message is assigned, so that `return` may stand in front.
struct Failure {
    const char* what;
    const char* file;
    int line;

    void operator=(const Message& message) const {  // NOLINT: as GoogleTest does it
        ++failures;
        qduino::board::metal::report(
            qduino::text<std::string>(file, ':', line, ": not so: ", what, ' ', message.words(), '\n'));
    }
};

/// Four units in the last place apart, as GoogleTest has it.
template <typename Number>
bool nearly_equal(Number a, Number b) {
    const Number size = std::fmax(std::fabs(a), std::fabs(b));
    return std::fabs(a - b) <= 4 * std::numeric_limits<Number>::epsilon() * size;
}

template <typename TestCase>
void run() {
    TestCase test;
    test.body();
}

}  // namespace testing

#define TESTING_CHECK(condition, what, then) \
    if (condition) {                         \
    } else                                   \
        then ::testing::Failure{what, __FILE__, __LINE__} = ::testing::Message()

#define EXPECT_TRUE(a) TESTING_CHECK(static_cast<bool>(a), #a, )
#define EXPECT_FALSE(a) TESTING_CHECK(!static_cast<bool>(a), "not " #a, )
#define EXPECT_EQ(a, b) TESTING_CHECK((a) == (b), #a " == " #b, )
#define EXPECT_GE(a, b) TESTING_CHECK((a) >= (b), #a " >= " #b, )
#define EXPECT_GT(a, b) TESTING_CHECK((a) > (b), #a " > " #b, )
#define EXPECT_LE(a, b) TESTING_CHECK((a) <= (b), #a " <= " #b, )
#define EXPECT_LT(a, b) TESTING_CHECK((a) < (b), #a " < " #b, )
#define EXPECT_DOUBLE_EQ(a, b) TESTING_CHECK(::testing::nearly_equal<double>(a, b), #a " == " #b, )
#define EXPECT_FLOAT_EQ(a, b) TESTING_CHECK(::testing::nearly_equal<float>(a, b), #a " == " #b, )
#define ASSERT_TRUE(a) TESTING_CHECK(static_cast<bool>(a), #a, return )
#define ASSERT_FALSE(a) TESTING_CHECK(!static_cast<bool>(a), "not " #a, return )
#define ASSERT_EQ(a, b) TESTING_CHECK((a) == (b), #a " == " #b, return )
#define ASSERT_NE(a, b) TESTING_CHECK((a) != (b), #a " != " #b, return )
#define ASSERT_GE(a, b) TESTING_CHECK((a) >= (b), #a " >= " #b, return )
#define ASSERT_GT(a, b) TESTING_CHECK((a) > (b), #a " > " #b, return )

#define TYPED_TEST_SUITE_P(Suite) static_assert(true)
#define TYPED_TEST_P(Suite, Name)       \
    template <typename Bench>           \
    struct Name : public Suite<Bench> { \
        using TypeParam = Bench;        \
        void body();                    \
    };                                  \
    template <typename Bench>           \
    void Name<Bench>::body()

// One entry for each name: the list is scanned again and again (C++20's __VA_OPT__ ends it).
#define TESTING_SCAN(...) TESTING_SCAN3(TESTING_SCAN3(TESTING_SCAN3(TESTING_SCAN3(__VA_ARGS__))))
#define TESTING_SCAN3(...) TESTING_SCAN2(TESTING_SCAN2(TESTING_SCAN2(TESTING_SCAN2(__VA_ARGS__))))
#define TESTING_SCAN2(...) TESTING_SCAN1(TESTING_SCAN1(TESTING_SCAN1(TESTING_SCAN1(__VA_ARGS__))))
#define TESTING_SCAN1(...) __VA_ARGS__
#define TESTING_NOTHING ()
#define TESTING_CASES(Name, ...) \
    ::testing::Case{#Name,       \
                    &::testing::run<Name<Bench>>} __VA_OPT__(, TESTING_MORE TESTING_NOTHING(__VA_ARGS__))
#define TESTING_MORE() TESTING_CASES

#define REGISTER_TYPED_TEST_SUITE_P(Suite, ...) \
    template <typename Bench>                   \
    constexpr ::testing::Case Suite##Cases[] = {TESTING_SCAN(TESTING_CASES(__VA_ARGS__))}
#define INSTANTIATE_TYPED_TEST_SUITE_P(Prefix, Suite, Bench) \
    std::span<const ::testing::Case> testing::cases() { return Suite##Cases<Bench>; }
