#include "web/authentication.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "web/net/key_file.h"

namespace qduino::web::authentication_test {
namespace {

constexpr Instant kNow = instant_from_ns(1'000'000'000'000);
const std::string kKey(43, 'k');

RequestHead with(std::string name, std::string value) {
    RequestHead head;
    head.headers.push_back({std::move(name), std::move(value)});
    return head;
}

TEST(Key, IsMadeOnceReadableByItsOwnerAlone) {
    std::string folder = "/tmp/key-XXXXXX";
    ASSERT_NE(::mkdtemp(folder.data()), nullptr);
    const std::filesystem::path file = std::filesystem::path{folder} / "api-key";
    const Result<std::string> made = load_or_make_key(file);
    ASSERT_TRUE(made.ok());
    EXPECT_EQ(made->size(), 43u);
    struct stat found {};
    ASSERT_EQ(::stat(file.c_str(), &found), 0);
    EXPECT_EQ(found.st_mode & 0777, 0600u);
    EXPECT_EQ(*load_or_make_key(file), *made);
    ::chmod(file.c_str(), 0644);
    EXPECT_EQ(load_or_make_key(file).error().code, ErrorCode::not_permitted);
    ::chmod(file.c_str(), 0600);
    std::ofstream{file} << "short\n";
    EXPECT_EQ(load_or_make_key(file).error().code, ErrorCode::corrupt);
    std::filesystem::remove_all(folder);
}

TEST(Tokens, AreRandomAndSafeInAddresses) {
    const std::string token = random_token();
    EXPECT_EQ(token.size(), 43u);
    EXPECT_NE(token, random_token());
    EXPECT_EQ(token.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_"),
              std::string::npos);
}

TEST(ConstantTime, ComparesByValue) {
    EXPECT_TRUE(equal_in_constant_time("abc", "abc"));
    EXPECT_FALSE(equal_in_constant_time("abc", "abd"));
    EXPECT_FALSE(equal_in_constant_time("abc", "abcd"));
    EXPECT_FALSE(equal_in_constant_time("", "a"));
}

TEST(Authenticator, TakesTheKeyInTwoHeaders) {
    Authenticator authenticator{kKey, {}, random_token};
    EXPECT_EQ(authenticator.prove(with("X-Api-Key", kKey), "a", kNow, 0), Proof::key);
    EXPECT_EQ(authenticator.prove(with("Authorization", "Bearer " + kKey), "a", kNow, 0), Proof::key);
    EXPECT_EQ(authenticator.prove(with("authorization", "bearer  " + kKey), "a", kNow, 0), Proof::key);
    EXPECT_EQ(authenticator.prove(with("X-Api-Key", kKey + "x"), "a", kNow, 0), Proof::none);
    EXPECT_EQ(authenticator.prove(with("X-Api-Key", ""), "a", kNow, 0), Proof::none);
    EXPECT_EQ(authenticator.prove(with("Authorization", "Basic " + kKey), "a", kNow, 0), Proof::none);
    EXPECT_EQ(authenticator.prove({}, "a", kNow, 0), Proof::none);
    EXPECT_EQ((Authenticator{"", {}, random_token}.prove({}, "a", kNow, 0)), Proof::off);
}

TEST(Authenticator, TakesASessionUntilItEnds) {
    Authenticator authenticator{kKey, {}, random_token};
    const auto made = authenticator.sessions.make(1000);
    const RequestHead head = with("Cookie", "other=1; qduino_session=" + made.token + "; more=2");
    EXPECT_EQ(authenticator.prove(head, "a", kNow, 1000), Proof::cookie);
    EXPECT_EQ(authenticator.prove(head, "a", kNow, 1000 + SessionTable::kLifetime_s - 1), Proof::cookie);
    EXPECT_EQ(authenticator.prove(head, "a", kNow, 1000 + SessionTable::kLifetime_s), Proof::none);
    Authenticator restarted{kKey, {made.record}, random_token};
    EXPECT_EQ(restarted.prove(head, "a", kNow, 1000), Proof::cookie);
    EXPECT_EQ(restarted.sessions.end(made.token), made.record.token_hash);
    EXPECT_EQ(restarted.prove(head, "a", kNow, 1000), Proof::none);
    EXPECT_EQ(made.record.token_hash.find(made.token), std::string::npos) << "the token itself is not stored";
}

TEST(SessionTable, IsBounded) {
    SessionTable table{random_token};
    const auto first = table.make(1);
    for (std::size_t i = 0; i < SessionTable::kSessionsMax; ++i) static_cast<void>(table.make(2));
    EXPECT_FALSE(table.contains(first.token, 2)) << "the oldest gives way";
}

TEST(SessionTable, AClockThatJumpsForgetsNone) {
    SessionTable table{random_token};
    const auto first = table.make(1'000'000);
    static_cast<void>(table.make(4'000'000'000));
    static_cast<void>(table.make(1000));
    EXPECT_TRUE(table.contains(first.token, 1'000'001));
}

TEST(TicketTable, IsValidOnceForHalfAMinute) {
    TicketTable table{random_token, Authenticator::kLiveLifetime};
    const std::string ticket = table.make(kNow);
    EXPECT_FALSE(table.take("other", kNow));
    EXPECT_TRUE(table.take(ticket, kNow));
    EXPECT_FALSE(table.take(ticket, kNow));
    const std::string late = table.make(kNow);
    EXPECT_FALSE(table.take(late, kNow + Authenticator::kLiveLifetime));
}

TEST(FailureLimiter, StopsAnAddressAndLetsItComeBack) {
    FailureLimiter limiter;
    for (int i = 0; i < FailureLimiter::kBurst; ++i) {
        EXPECT_TRUE(limiter.allows("a", kNow)) << i;
        limiter.failed("a", kNow);
    }
    EXPECT_FALSE(limiter.allows("a", kNow));
    EXPECT_TRUE(limiter.allows("b", kNow)) << "others are not concerned";
    EXPECT_TRUE(limiter.allows("a", kNow + FailureLimiter::kEvery + Nanoseconds{1}));
}

TEST(FailureLimiter, ForgetsTheOldestOfTooManyAddresses) {
    FailureLimiter limiter;
    for (int i = 0; i < FailureLimiter::kBurst; ++i) limiter.failed("first", kNow);
    EXPECT_FALSE(limiter.allows("first", kNow));
    const Instant later = kNow + FailureLimiter::kBurst * FailureLimiter::kEvery;
    for (std::size_t i = 0; i < FailureLimiter::kAddressesMax; ++i) limiter.failed(std::to_string(i), later);
    EXPECT_TRUE(limiter.allows("first", kNow)) << "its place was needed";
}

TEST(Authenticator, TheRightKeyIsNeverRefusedForWrongOnes) {
    Authenticator authenticator{kKey, {}, random_token};
    const auto made = authenticator.sessions.make(1000);
    const std::string ticket = authenticator.tickets.make(kNow);
    int wrong = 0, limited = 0;
    for (int i = 0; i < 1000; ++i) {
        const Proof proof = authenticator.prove(with("X-Api-Key", "wrong"), "a", kNow, 1000);
        (proof == Proof::limited ? limited : wrong) += 1;
        EXPECT_EQ(authenticator.prove(with("X-Api-Key", kKey), "a", kNow, 1000), Proof::key);
        EXPECT_EQ(authenticator.prove_key(kKey, "a", kNow), Proof::key);
        EXPECT_EQ(authenticator.prove(with("Cookie", "qduino_session=" + made.token), "a", kNow, 1000),
                  Proof::cookie);
    }
    EXPECT_EQ(wrong, FailureLimiter::kBurst);
    EXPECT_EQ(limited, 1000 - FailureLimiter::kBurst);
    EXPECT_TRUE(authenticator.tickets.take(ticket, kNow));
}

TEST(PresentedKey, IsThatOfXApiKeyBeforeABearer) {
    EXPECT_EQ(presented_key(with("X-Api-Key", "k")), "k");
    EXPECT_EQ(presented_key(with("Authorization", "bEARER  k")), "k");
    RequestHead both = with("Authorization", "Bearer other");
    both.headers.push_back({"X-Api-Key", ""});
    EXPECT_EQ(presented_key(both), "") << "an empty one is shown, and is wrong";
    for (const char* other : {"Basic a2V5", "Bearer", "Bearer ", ""})
        EXPECT_EQ(presented_key(with("Authorization", other)), std::nullopt) << other;
    EXPECT_EQ(presented_key(RequestHead{}), std::nullopt);
}

TEST(Cookie, ValuesAreFoundByWholeName) {
    EXPECT_EQ(cookie_value("a=1; b=2", "b"), "2");
    EXPECT_EQ(cookie_value("ab=1", "b"), "");
    EXPECT_EQ(cookie_value("b", "b"), "");
    EXPECT_EQ(cookie_value("", "b"), "");
    EXPECT_EQ(cookie_value(";;;b=;", "b"), "");
}

TEST(AddressTable, AdmitsForAMinuteBehindTheLastRequest) {
    AddressTable visitors;
    const Instant begin = instant_from_ns(0);
    EXPECT_FALSE(visitors.admits("10.0.0.1", begin));
    visitors.enter("10.0.0.1", begin);
    EXPECT_FALSE(visitors.admits("10.0.0.2", begin));
    EXPECT_TRUE(visitors.admits("10.0.0.1", begin + 59s));
    EXPECT_TRUE(visitors.admits("10.0.0.1", begin + 118s)) << "it began anew";
    EXPECT_FALSE(visitors.admits("10.0.0.1", begin + 178s));
    visitors.enter("10.0.0.1", begin + 200s);
    EXPECT_TRUE(visitors.leave("10.0.0.1"));
    EXPECT_FALSE(visitors.admits("10.0.0.1", begin + 200s));
    EXPECT_FALSE(visitors.leave("10.0.0.1"));
}

TEST(AddressTable, ForgetsTheOldestOfTooMany) {
    AddressTable visitors;
    const auto name = [](std::size_t i) { return "10.0.1." + std::to_string(i); };
    for (std::size_t i = 0; i <= AddressTable::kAddressesMax; ++i)
        visitors.enter(name(i), instant_from_ns(static_cast<std::int64_t>(i)));
    EXPECT_FALSE(visitors.admits(name(0), instant_from_ns(100)));
    EXPECT_TRUE(visitors.admits(name(1), instant_from_ns(100)));
}

}  // namespace
}  // namespace qduino::web::authentication_test
