// Who may: the key, browser sessions, one-time tickets for the live stream, and a limit on wrong tries.
//
// The key is 32 random bytes, made at the first start and kept in a file that only the service's user reads; no request
// ever returns it. Everything presented is compared by its digest in constant time
// (libsodium), so neither length nor first difference shows in the time. Sessions and tickets are random tokens of which
// only the SHA-256 is kept. Time is a parameter. One thread.
//
// What is presented is always compared, and what is right is always let in: wrong tries of others from the same address (a NAT, this
// machine) must not lock out the owner, least of all from the emergency stop. So the limit does not hide from a guesser that he
// guessed right; 256 random bits do that. It tells wrong tries that they are too many, and makes each of them cost a
// connection: a client that repeats an old key for ever is told to wait, and guessing takes little of the service's time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/store.h"
#include "web/http.h"

namespace qduino::web {

/// 32 random bytes as base64url, 43 characters.
[[nodiscard]] std::string random_token();

/// The key in `file`, made (mode 0600) when there is none. Errors: not_permitted (others may read it), internal, corrupt.
[[nodiscard]] Result<std::string> load_or_make_key(const std::filesystem::path& file);

/// True in the same time for every pair of equal-sized inputs, and nearly so for any.
[[nodiscard]] bool equal_in_constant_time(std::string_view a, std::string_view b);

/// Wrong tries per address: kBurst at once, then one every kEvery; what is above is too many. Bounded in memory: the oldest address is
/// forgotten.
class FailureLimiter {
  public:
    static constexpr int kBurst = 20;
    static constexpr Nanoseconds kEvery = std::chrono::seconds{3};
    static constexpr std::size_t kAddressesMax = 1024;

    [[nodiscard]] bool allows(const std::string& remote, Instant now) const;
    void failed(const std::string& remote, Instant now);

  private:
    // As a virtual schedule (the leaky bucket of ITU-T I.371): each failure moves it by kEvery; too far ahead is too many.
    std::map<std::string, Instant> schedule_;
};

class SessionTable {
  public:
    static constexpr spool::UnixSeconds kLifetime_s = 12 * 3600;
    static constexpr std::size_t kSessionsMax = 256;

    explicit SessionTable(std::vector<spool::SessionRecord> stored = {});
    struct Made {
        std::string token;
        spool::SessionRecord record;  ///< to be stored before the token is given out
    };
    [[nodiscard]] Made make(spool::UnixSeconds now_s);
    [[nodiscard]] bool contains(std::string_view token, spool::UnixSeconds now_s) const;
    /// The hash to erase from the store.
    std::string end(std::string_view token);

  private:
    std::map<std::string, spool::UnixSeconds> expires_;  // by hash
};

class TicketTable {
  public:
    static constexpr Nanoseconds kLifetime = std::chrono::seconds{30};
    static constexpr std::size_t kTicketsMax = 256;

    [[nodiscard]] std::string make(Instant now);
    /// True once.
    [[nodiscard]] bool take(std::string_view ticket, Instant now);

  private:
    std::map<std::string, Instant> expires_;  // by hash
};

/// How a request proved itself.
enum class Proof : std::uint8_t {
    none,  ///< nothing was presented, or it was wrong
    key,
    cookie,   ///< a browser did: the request must come from our own page
    limited,  ///< it was wrong, as too many before it from this address
    off,      ///< authentication is off
};

class Authenticator {
  public:
    static constexpr std::string_view kCookie = "qduino_session";

    /// An empty key turns authentication off.
    Authenticator(std::string key, std::vector<spool::SessionRecord> stored);

    /// Looks at X-Api-Key, Authorization: Bearer, and the cookie. A wrong key counts as a failure; a right one is never refused.
    [[nodiscard]] Proof prove(const RequestHead& head, const std::string& remote, Instant now,
                              spool::UnixSeconds now_s);
    /// A key presented in a body.
    [[nodiscard]] Proof prove_key(std::string_view key, const std::string& remote, Instant now);
    [[nodiscard]] bool is_off() const { return key_.empty(); }

    SessionTable sessions;
    TicketTable tickets;

  private:
    std::string key_;
    FailureLimiter failures_;
};

/// The value of one cookie in a Cookie field; empty when absent.
[[nodiscard]] std::string_view cookie_value(std::string_view cookies, std::string_view name);

}  // namespace qduino::web
