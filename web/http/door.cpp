#include "web/http/door.h"

#include <algorithm>

#include "base/contract.h"

namespace qduino::web {

namespace {

// 64 live streams, 32 uploads with their files, journal, log, loops.
constexpr std::size_t kOtherDescriptors = 192;
constexpr std::size_t kPlacesMin = 8;

}  // namespace

// ---- limits -------------------------------------------------------------------------------------

std::size_t DoorLimits::descriptors() const { return strangers_max + known_max + kOtherDescriptors; }

DoorLimits DoorLimits::within(std::size_t descriptors) const {
    if (descriptors >= this->descriptors()) return *this;
    const std::size_t places = descriptors > kOtherDescriptors ? descriptors - kOtherDescriptors : 0;
    const auto scaled = [&](std::size_t wanted) {
        const std::size_t part = wanted * places / (strangers_max + known_max);
        return std::min(wanted, std::max(part, kPlacesMin));
    };
    DoorLimits fewer = *this;
    fewer.strangers_max = scaled(strangers_max);
    fewer.strangers_of_address_max = scaled(strangers_of_address_max);
    fewer.known_max = scaled(known_max);
    return fewer;
}

// ---- arriving -----------------------------------------------------------------------------------

Door::Leaver Door::enter(Id id, std::string address, Instant now) {
    QDUINO_EXPECT(!places_.contains(id));
    const Leaver leaver = room_for_stranger(address);
    Place place;
    place.address = std::move(address);
    place.since = now;
    insert(id, place);
    places_.emplace(id, std::move(place));
    return leaver;
}

Door::Leaver Door::set_known(Id id, bool known) {
    const auto at = places_.find(id);
    if (at == places_.end() || at->second.known == known) return std::nullopt;
    remove(id, at->second);
    Leaver leaver;
    if (!known) leaver = room_for_stranger(at->second.address);
    if (known && known_.size() >= limits_.known_max) leaver = drop_first_of(known_);
    at->second.known = known;
    insert(id, at->second);
    return leaver;
}

void Door::set_busy(Id id, bool busy, Instant now) {
    const auto at = places_.find(id);
    if (at == places_.end()) return;
    remove(id, at->second);
    at->second.busy = busy;
    if (!busy) at->second.since = now;
    insert(id, at->second);
}

Door::Leaver Door::set_held(Id id, std::size_t bytes, Instant now) {
    const auto at = places_.find(id);
    if (at == places_.end()) return std::nullopt;
    held_bytes_ += bytes;
    held_bytes_ -= at->second.held;
    at->second.held = bytes;
    at->second.held_since = now;
    if (held_bytes_ <= limits_.held_bytes_max) return std::nullopt;
    // This is rare, and the places are few, so it looks at each. Strangers go first; the connection
    // that has just become known never does.
    using Rank = std::tuple<bool, Instant, Id>;
    std::optional<Rank> first;
    for (const auto& [other, place] : places_) {
        if (other == id || place.held == 0) continue;
        const Rank rank{place.known, place.held_since, other};
        if (!first || rank < *first) first = rank;
    }
    return first ? drop(std::get<Id>(*first)) : std::nullopt;
}

// ---- leaving ------------------------------------------------------------------------------------

Door::Leaver Door::make_room() {
    if (strangers_ > 0) return drop_stranger();
    const bool someone_waits = !known_.empty() && !std::get<bool>(*known_.begin());
    return someone_waits ? drop_first_of(known_) : std::nullopt;
}

Door::Leaver Door::room_for_stranger(const std::string& address) {
    const auto same = strangers_of_.find(address);
    if (same != strangers_of_.end() && same->second.size() >= limits_.strangers_of_address_max)
        return drop_first_of(same->second);
    return strangers_ >= limits_.strangers_max ? drop_stranger() : std::nullopt;
}

/// The oldest connection of the address that holds the most places. Among several such addresses it
/// is the one with the oldest.
Door::Leaver Door::drop_stranger() {
    const auto goes_later = [](const auto& a, const auto& b) {
        if (a.second.size() != b.second.size()) return a.second.size() < b.second.size();
        return *a.second.begin() > *b.second.begin();
    };
    return drop_first_of(std::max_element(strangers_of_.begin(), strangers_of_.end(), goes_later)->second);
}

Door::Leaver Door::drop_first_of(const Order& order) {
    return order.empty() ? std::nullopt : drop(std::get<Id>(*order.begin()));
}

Door::Leaver Door::drop(Id id) {
    const auto at = places_.find(id);
    if (at == places_.end()) return std::nullopt;
    held_bytes_ -= at->second.held;
    remove(id, at->second);
    places_.erase(at);
    return id;
}

void Door::insert(Id id, const Place& place) {
    if (place.known) {
        known_.emplace(place.busy, place.since, id);
        return;
    }
    strangers_of_[place.address].emplace(false, place.since, id);
    ++strangers_;
}

void Door::remove(Id id, const Place& place) {
    if (place.known) {
        known_.erase({place.busy, place.since, id});
        return;
    }
    const auto same = strangers_of_.find(place.address);
    same->second.erase({false, place.since, id});
    --strangers_;
    if (same->second.empty()) strangers_of_.erase(same);
}

}  // namespace qduino::web
