#include "base/result.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace qduino::result_test {
namespace {

Result<int> half(int number) {
    if (number % 2 != 0) return make_error(ErrorCode::invalid_argument, "7 is odd: give an even number");
    return number / 2;
}

TEST(Result, HoldsAValue) {
    const Result<int> result = half(8);
    EXPECT_TRUE(result.ok());
    EXPECT_TRUE(static_cast<bool>(result));
    EXPECT_EQ(*result, 4);
}

TEST(Result, HoldsAnError) {
    const Result<int> result = half(7);
    ASSERT_FALSE(result.ok());
    EXPECT_EQ(result.error().code, ErrorCode::invalid_argument);
    EXPECT_EQ(result.error().message, "7 is odd: give an even number");
}

TEST(Result, MovesOutWhatOnlyMoves) {
    Result<std::unique_ptr<int>> result{std::make_unique<int>(5)};
    const std::unique_ptr<int> taken = std::move(result).value();
    EXPECT_EQ(*taken, 5);
}

TEST(Result, ReachesMembers) {
    Result<std::string> result{std::string{"abc"}};
    result->push_back('d');
    EXPECT_EQ(result.value(), "abcd");
}

TEST(Result, OfNothing) {
    const Result<void> fine;
    EXPECT_TRUE(fine.ok());
    const Result<void> failed = make_error(ErrorCode::unavailable, "full");
    EXPECT_FALSE(failed.ok());
    EXPECT_EQ(failed.error().code, ErrorCode::unavailable);
}

TEST(Result, AnErrorTextIsCutNotOverrun) {
    const Error error = make_error(ErrorCode::internal, std::string(1000, 'x'));
    EXPECT_EQ(error.message.size(), 236u);
}

TEST(ResultDeathTest, ReadingTheWrongSideIsABrokenContract) {
    Result<int> failed = half(7);
    const Result<int> fine = half(8);
    EXPECT_DEATH(static_cast<void>(failed.value()), "contract broken");
    EXPECT_DEATH(static_cast<void>(fine.error()), "contract broken");
    EXPECT_DEATH(static_cast<void>(Result<void>{}.error()), "contract broken");
}

Result<int> quarter(int number) {
    QDUINO_TRY_ASSIGN(const int halved, half(number));
    QDUINO_TRY(half(halved));
    return halved / 2;
}

TEST(Try, GivesTheValueOrHandsTheErrorOn) {
    EXPECT_EQ(*quarter(8), 2);
    EXPECT_EQ(quarter(7).error().message, "7 is odd: give an even number");
    EXPECT_EQ(quarter(6).error().code, ErrorCode::invalid_argument);
}

TEST(Try, MovesOutWhatOnlyMoves) {
    const auto taken = []() -> Result<int> {
        QDUINO_TRY_ASSIGN(const auto only, Result<std::unique_ptr<int>>{std::make_unique<int>(5)});
        return *only;
    };
    EXPECT_EQ(*taken(), 5);
}

TEST(MakeError, JoinsPieces) {
    EXPECT_EQ(make_error(ErrorCode::not_found, "no job ", 7, ": look at ", std::string{"the list"}).message,
              "no job 7: look at the list");
}

}  // namespace
}  // namespace qduino::result_test
