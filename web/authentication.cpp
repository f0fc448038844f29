#include "web/authentication.h"

#include <algorithm>

#include "base/sha256.h"

namespace qduino::web {

namespace {

std::string sha256_of(std::string_view text) {
    BareSha256 hash;
    hash.add({text.data(), text.size()});
    return hash.finish();
}

template <typename Time>
void forget_first_to_end(std::map<std::string, Time>& entries, std::size_t size_max) {
    while (entries.size() > size_max) {
        entries.erase(std::min_element(entries.begin(), entries.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; }));
    }
}

}  // namespace

bool equal_in_constant_time(std::string_view a, std::string_view b) {
    const std::string digest_a = sha256_of(a);
    const std::string digest_b = sha256_of(b);
    unsigned difference = 0;
    for (std::size_t i = 0; i < digest_a.size(); ++i)
        difference |= static_cast<unsigned char>(digest_a[i]) ^ static_cast<unsigned char>(digest_b[i]);
    return difference == 0;
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

SessionTable::SessionTable(TokenSource new_token, std::vector<spool::SessionRecord> stored)
    : new_token_(new_token) {
    for (spool::SessionRecord& record : stored) expires_[std::move(record.token_hash)] = record.expires_s;
    forget_first_to_end(expires_, kSessionsMax);
}

SessionTable::Made SessionTable::make(spool::UnixSeconds now_s) {
    // None is forgotten by the calendar, which may have jumped: their number is bounded.
    Made made;
    made.token = new_token_();
    made.record = {sha256_of(made.token), now_s + kLifetime_s};
    expires_[made.record.token_hash] = made.record.expires_s;
    forget_first_to_end(expires_, kSessionsMax);
    return made;
}

bool SessionTable::contains(std::string_view token, spool::UnixSeconds now_s) const {
    if (token.size() != kTokenLength) return false;
    const auto at = expires_.find(sha256_of(token));
    return at != expires_.end() && now_s < at->second;
}

std::string SessionTable::end(std::string_view token) {
    const std::string hash = sha256_of(token);
    expires_.erase(hash);
    return hash;
}

// ---- tickets ------------------------------------------------------------------------------------

std::string TicketTable::make(Instant now) {
    std::erase_if(expires_, [&](const auto& entry) { return entry.second <= now; });
    std::string ticket = new_token_();
    expires_[sha256_of(ticket)] = now + lifetime_;
    forget_first_to_end(expires_, kTicketsMax);
    return ticket;
}

bool TicketTable::take(std::string_view ticket, Instant now) {
    const auto at = expires_.find(sha256_of(ticket));
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

Authenticator::Authenticator(std::string key, std::vector<spool::SessionRecord> stored, TokenSource new_token)
    : sessions(new_token, std::move(stored)),
      tickets(new_token, kLiveLifetime),
      invitations(new_token, kInvitationLifetime),
      key_(std::move(key)) {}

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
