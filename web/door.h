// Who has a place at the service, and who gives up his own when the places run out. No sockets: time and names are parameters.
//
//   strangers   connections that have not shown the key. A newcomer always gets a place; when there is none, the stranger goes who
//               has finished nothing for the longest time, of the address that holds the most. So a flood from one address drops
//               its own connections first, and slow heads are older than whoever comes with a whole request.
//   known       connections whose requests have proved a key, a session or a ticket. Their places are their own: no number of
//               strangers takes one. When they are too many, one that waits between requests goes, the longest idle first.
//
// Why the oldest, and not the slowest or the least important kind: whatever kind goes last is the kind that an attacker
// fills the places with. Age he cannot fake: to be young he has to finish a request or to come anew.
//
// The same for memory: when what waits to be sent is too much in all, whoever has held his part the longest goes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <tuple>

#include "base/time.h"

namespace qduino::web {

struct DoorLimits {
    std::size_t strangers_max = 1024;
    std::size_t strangers_of_address_max = 768;
    std::size_t known_max = 128;
    std::size_t held_bytes_max = std::size_t{64} << 20;  ///< waiting to be sent, over all connections

    /// These, or fewer in the same proportions when the process may open only so many descriptors. 8 of a kind at least.
    [[nodiscard]] DoorLimits within(std::size_t descriptors) const;
    /// What the process needs for them and everything else it opens: files, the journal, live streams.
    [[nodiscard]] std::size_t descriptors() const;
};

class Door {
  public:
    using Id = std::uint64_t;
    /// Who has to go, when one has to. He is forgotten already: his connection is the caller's to close.
    using Leaver = std::optional<Id>;

    explicit Door(DoorLimits limits = {}) : limits_(limits) {}

    /// A stranger from `address` comes, and gets a place.
    [[nodiscard]] Leaver enter(Id id, std::string address, Instant now);
    /// He has shown the key, or (false) a wrong one.
    [[nodiscard]] Leaver set_known(Id id, bool known);
    /// He begins a request, or (false) waits for the next one. The second makes him young again.
    void set_busy(Id id, bool busy, Instant now);
    /// So many bytes wait to be sent to him; 0: none any more.
    [[nodiscard]] Leaver set_held(Id id, std::size_t bytes, Instant now);
    /// A place is needed although none of the limits says so: the process cannot open another socket. Nobody when all that are
    /// left are known and busy.
    [[nodiscard]] Leaver make_room();
    void leave(Id id);

    [[nodiscard]] std::size_t strangers() const { return strangers_; }
    [[nodiscard]] std::size_t known() const { return known_.size(); }
    [[nodiscard]] std::size_t held_bytes() const { return held_bytes_; }

  private:
    struct Place {
        std::string address;
        bool known = false;
        bool busy = false;
        Instant since{};  // the last time it finished something, or came
        std::size_t held = 0;
        Instant held_since{};
    };
    using Order =
        std::set<std::tuple<bool, Instant, Id>>;  // the first goes first; of strangers the bool is false

    void insert(Id id, const Place& place);
    void remove(Id id, const Place& place);
    [[nodiscard]] Leaver drop(Id id);
    [[nodiscard]] Leaver drop_first_of(const Order& order);
    [[nodiscard]] Leaver drop_stranger();
    [[nodiscard]] Leaver room_for_stranger(const std::string& address);

    DoorLimits limits_;
    std::map<Id, Place> places_;
    std::map<std::string, Order> strangers_of_;  // by address; none of them is empty
    std::size_t strangers_ = 0;
    Order known_;
    std::size_t held_bytes_ = 0;
};

}  // namespace qduino::web
