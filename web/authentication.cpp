#include "web/authentication.h"

#include <fcntl.h>
#include <sodium/core.h>
#include <sodium/crypto_generichash.h>
#include <sodium/randombytes.h>
#include <sodium/utils.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>

#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"
#include "spool/sha256.h"

namespace qduino::web {

namespace {

constexpr std::size_t kTokenBytes = 32;
constexpr std::size_t kTokenLength = 43;

Result<std::string> make_key(const std::filesystem::path& file) {
    const std::string key = random_token();
    QDUINO_TRY(posix::write_durably(file, key + "\n"));
    return key;
}

template <typename Time>
void forget_first_to_end(std::map<std::string, Time>& entries, std::size_t size_max) {
    while (entries.size() > size_max) {
        entries.erase(std::min_element(entries.begin(), entries.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; }));
    }
}

}  // namespace

std::string random_token() {
    std::array<unsigned char, kTokenBytes> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    std::array<char, kTokenLength + 1> text{};
    sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(),
                      sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    return text.data();
}

Result<std::string> load_or_make_key(const std::filesystem::path& file) {
    const posix::UniqueFd opened{::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)};
    if (!opened.valid() && errno == ENOENT) return make_key(file);
    if (!opened.valid()) return posix::system_error("open the key file", file.native());
    struct stat found {};
    if (::fstat(opened.get(), &found) != 0) return posix::system_error("look at the key file", file.native());
    QDUINO_TRY_ASSIGN(std::string key, posix::read_to_end(opened.get(), file.native()));
    if ((found.st_mode & 077) != 0) {
        return make_error(ErrorCode::not_permitted, "others may read the key file; chmod 600 ",
                          file.native());
    }
    while (!key.empty() && (key.back() == '\n' || key.back() == '\r')) key.pop_back();
    if (key.size() < 16) {
        return make_error(ErrorCode::corrupt,
                          "the key file holds no key of at least 16 characters; delete it to have one made: ",
                          file.native());
    }
    return key;
}

bool equal_in_constant_time(std::string_view a, std::string_view b) {
    const auto digest = [](std::string_view text) {
        std::array<unsigned char, 32> out{};
        crypto_generichash(out.data(), out.size(), reinterpret_cast<const unsigned char*>(text.data()),
                           text.size(), nullptr, 0);
        return out;
    };
    return sodium_memcmp(digest(a).data(), digest(b).data(), 32) == 0;
}

// ---- failures -----------------------------------------------------------------------------------

bool FailureLimiter::allows(const std::string& remote, Instant now) const {
    const auto at = schedule_.find(remote);
    return at == schedule_.end() || at->second - now < kBurst * kEvery;
}

void FailureLimiter::failed(const std::string& remote, Instant now) {
    Instant& scheduled = schedule_.try_emplace(remote, now).first->second;
    scheduled = std::max(scheduled, now) + kEvery;
    forget_first_to_end(schedule_, kAddressesMax);
}

// ---- sessions -----------------------------------------------------------------------------------

SessionTable::SessionTable(std::vector<spool::SessionRecord> stored) {
    for (spool::SessionRecord& record : stored) expires_[std::move(record.token_hash)] = record.expires_s;
    forget_first_to_end(expires_, kSessionsMax);
}

SessionTable::Made SessionTable::make(spool::UnixSeconds now_s) {
    // None is forgotten by the calendar, which may have jumped: their number is bounded.
    Made made;
    made.token = random_token();
    made.record = {spool::sha256_of(made.token), now_s + kLifetime_s};
    expires_[made.record.token_hash] = made.record.expires_s;
    forget_first_to_end(expires_, kSessionsMax);
    return made;
}

bool SessionTable::contains(std::string_view token, spool::UnixSeconds now_s) const {
    if (token.size() != kTokenLength) return false;
    const auto at = expires_.find(spool::sha256_of(token));
    return at != expires_.end() && now_s < at->second;
}

std::string SessionTable::end(std::string_view token) {
    const std::string hash = spool::sha256_of(token);
    expires_.erase(hash);
    return hash;
}

// ---- tickets ------------------------------------------------------------------------------------

std::string TicketTable::make(Instant now) {
    std::erase_if(expires_, [&](const auto& entry) { return entry.second <= now; });
    std::string ticket = random_token();
    expires_[spool::sha256_of(ticket)] = now + lifetime_;
    forget_first_to_end(expires_, kTicketsMax);
    return ticket;
}

bool TicketTable::take(std::string_view ticket, Instant now) {
    const auto at = expires_.find(spool::sha256_of(ticket));
    if (at == expires_.end()) return false;
    const bool valid = now < at->second;
    expires_.erase(at);
    return valid;
}

// ---- addresses ----------------------------------------------------------------------------------

void AddressTable::enter(const std::string& remote, Instant now) {
    ends_[remote] = now + kLifetime;
    forget_first_to_end(ends_, kAddressesMax);
}

bool AddressTable::admits(const std::string& remote, Instant now) {
    const auto at = ends_.find(remote);
    if (at == ends_.end() || at->second <= now) return false;
    at->second = now + kLifetime;
    return true;
}

// ---- proofs -------------------------------------------------------------------------------------

Authenticator::Authenticator(std::string key, std::vector<spool::SessionRecord> stored)
    : sessions(std::move(stored)), key_(std::move(key)) {
    const int ready = sodium_init();
    QDUINO_EXPECT(ready >= 0);
}

Proof Authenticator::prove_key(std::string_view key, const std::string& remote, Instant now) {
    if (is_off()) return Proof::off;
    if (equal_in_constant_time(key, key_)) return Proof::key;
    if (!failures_.allows(remote, now)) return Proof::limited;
    failures_.failed(remote, now);
    return Proof::none;
}

Proof Authenticator::prove(const RequestHead& head, const std::string& remote, Instant now,
                           spool::UnixSeconds now_s) {
    if (is_off()) return Proof::off;
    if (const std::optional<std::string_view> key = presented_key(head)) return prove_key(*key, remote, now);
    if (head.find("Authorization")) return Proof::none;
    const std::string_view token = cookie_value(head.value("Cookie"), kSessionCookie);
    return !token.empty() && sessions.contains(token, now_s) ? Proof::cookie : Proof::none;
}

std::optional<Response> refusal_of(Proof proof) {
    if (proof == Proof::limited) {
        Response response = error_response(
            429, "not_permitted", "this key is wrong, and it was too many wrong ones from this address");
        response.add("Retry-After", "60");
        response.close = true;  // each further guess costs a connection
        return response;
    }
    if (proof != Proof::none) return std::nullopt;
    Response response = error_response(
        401, "not_permitted",
        "this needs the key: send it as X-Api-Key, or open the link that was printed at start");
    response.add("WWW-Authenticate", "Bearer");
    return response;
}

}  // namespace qduino::web
