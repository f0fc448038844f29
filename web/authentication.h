// Admits requests: the key, browser sessions, one-time tickets for the live stream, and a limit on
// wrong tries.
//
// The key is 32 random bytes, made at the first start and kept in a file that only the service's
// user reads; no request ever returns it. The service compares digests in constant time, so neither
// the length nor the first difference shows in the time. Sessions and
// tickets are random tokens; only their SHA-256 is kept. Time is a parameter. One thread.
//
// A limit that refuses all tries from an address locks out the owner, who may share it with a
// guesser (a NAT, this computer), and takes the emergency stop away. So the service always compares
// what is presented, and always admits what is right. The limit is no protection against a right
// guess; 256 random bits are. It tells wrong tries that they are too many, and makes each of them
// cost a connection: a client that repeats an old key for ever is told to wait, and guessing takes
// little of the service's time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/store.h"
#include "web/http/http.h"

namespace qduino::web {

inline constexpr std::size_t kTokenLength = 43;
/// Makes a token that nobody can guess: kTokenLength characters of base64url, 256 random bits.
using TokenSource = std::string (*)();

/// Takes the same time for every pair of equal size, and nearly so for any pair.
[[nodiscard]] bool equal_in_constant_time(std::string_view a, std::string_view b);

/// Wrong tries per address: kBurst at once, then one every kEvery; more are too many. Bounded in
/// memory: it forgets the oldest address.
class FailureLimiter {
  public:
    static constexpr int kBurst = 20;
    static constexpr Nanoseconds kEvery = std::chrono::seconds{3};
    static constexpr std::size_t kAddressesMax = 1024;

    [[nodiscard]] bool allows(const std::string& remote, Instant now) const;
    void failed(const std::string& remote, Instant now);

  private:
    // As a virtual schedule (the leaky bucket of ITU-T I.371): each failure moves it by kEvery. A
    // schedule too far ahead means too many.
    std::map<std::string, Instant> schedule_;
};

class SessionTable {
  public:
    static constexpr spool::UnixSeconds kLifetime_s = 12 * 3600;
    static constexpr std::size_t kSessionsMax = 256;

    explicit SessionTable(TokenSource new_token, std::vector<spool::SessionRecord> stored = {});
    struct Made {
        std::string token;
        spool::SessionRecord record;  ///< to be stored before the token is given out
    };
    [[nodiscard]] Made make(spool::UnixSeconds now_s);
    [[nodiscard]] bool contains(std::string_view token, spool::UnixSeconds now_s) const;
    /// The hash to erase from the store.
    std::string end(std::string_view token);

  private:
    TokenSource new_token_;
    std::map<std::string, spool::UnixSeconds> expires_;  // by hash
};

class TicketTable {
  public:
    static constexpr std::size_t kTicketsMax = 256;

    TicketTable(TokenSource new_token, Nanoseconds lifetime) : new_token_(new_token), lifetime_(lifetime) {}
    [[nodiscard]] std::string make(Instant now);
    /// True once for each ticket.
    [[nodiscard]] bool take(std::string_view ticket, Instant now);

  private:
    TokenSource new_token_;
    Nanoseconds lifetime_;
    std::map<std::string, Instant> expires_;  // by hash
};

/// Addresses that have shown the key lately: for interfaces whose clients show it once, and are
/// known by their address from then on. Bounded in memory: it forgets the one that was heard of
/// longest ago.
class AddressTable {
  public:
    static constexpr Nanoseconds kLifetime = std::chrono::seconds{60};  ///< behind its last request
    static constexpr std::size_t kAddressesMax = 64;

    void enter(const std::string& remote, Instant now);
    /// True for one that has been entered. Its time begins anew.
    [[nodiscard]] bool admits(const std::string& remote, Instant now);
    /// False: it was not there.
    bool leave(const std::string& remote) { return ends_.erase(remote) > 0; }

  private:
    std::map<std::string, Instant> ends_;
};

/// How a request proved itself.
enum class Proof : std::uint8_t {
    none,  ///< nothing was presented, or it was wrong
    key,
    cookie,   ///< a browser did: the request must come from our own page
    address,  ///< its address has shown the key before
    limited,  ///< it was wrong, as too many before it from this address
    off,      ///< authentication is off
};

class Authenticator {
  public:
    /// An empty key turns authentication off.
    Authenticator(std::string key, std::vector<spool::SessionRecord> stored, TokenSource new_token);

    /// Checks X-Api-Key, Authorization: Bearer, and the cookie. A wrong key counts as a failure; a
    /// right one is never refused.
    [[nodiscard]] Proof prove(const RequestHead& head, const std::string& remote, Instant now,
                              spool::UnixSeconds now_s);
    /// A key presented in a body.
    [[nodiscard]] Proof prove_key(std::string_view key, const std::string& remote, Instant now);
    [[nodiscard]] bool is_off() const { return key_.empty(); }

    static constexpr Nanoseconds kLiveLifetime = std::chrono::seconds{30};
    static constexpr Nanoseconds kInvitationLifetime = std::chrono::seconds{120};

    SessionTable sessions;
    TicketTable tickets;
    AddressTable visitors;
    /// For a session of another browser, a phone's: whoever is signed in gives them out.
    TicketTable invitations;

  private:
    std::string key_;
    FailureLimiter failures_;
};

/// The answer to a request that has not shown the key; nothing when it has.
[[nodiscard]] std::optional<Response> refusal_of(Proof proof);

}  // namespace qduino::web
