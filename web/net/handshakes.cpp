#include "web/net/handshakes.h"

#include <algorithm>

namespace qduino::web {

void Handshakes::wait(Id id, const std::string& address) {
    if (address_of_.try_emplace(id, address).second) waiting_[address].push_back(id);
}

std::optional<Handshakes::Turn> Handshakes::next(Instant now) {
    if (waiting_.empty() || scheduled_ - now > (kBurst - 1) * kEvery) return std::nullopt;
    scheduled_ = std::max(scheduled_, now) + kEvery;
    auto at = waiting_.upper_bound(served_last_);
    if (at == waiting_.end()) at = waiting_.begin();
    served_last_ = at->first;
    const Id id = at->second.front();
    at->second.pop_front();
    if (at->second.empty()) waiting_.erase(at);
    address_of_.erase(id);
    const Door::Leaver leaver = under_way_.enter(id, served_last_, now);
    return Turn{id, leaver};
}

void Handshakes::leave(Id id) {
    under_way_.leave(id);
    const auto found = address_of_.find(id);
    if (found == address_of_.end()) return;
    const auto same = waiting_.find(found->second);
    std::erase(same->second, id);
    if (same->second.empty()) waiting_.erase(same);
    address_of_.erase(found);
}

}  // namespace qduino::web
