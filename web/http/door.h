// Gives out the places at the service, and chooses the connection that leaves when they run out. No
// sockets: time and names are parameters.
//
// An attacker fills whatever kind of place goes last. So neither the slowest nor the least
// important connection leaves, but the oldest. Nobody can fake age: to be young, a connection has
// to finish a request or come anew.
//
//   strangers   connections that have not shown the key. A newcomer always gets a place. If there
//               is none, a stranger leaves: the one that has finished nothing for the longest time,
//               at the address that holds the most. A flood from one address drops its own.
//   known       connections whose requests have proved a key, a session or a ticket. Their places
//               are their own: no number of strangers takes one. If they are too many, one that
//               waits between requests leaves, the longest idle first.
//
// The same holds for memory: if too much waits to be sent in all, the connection that has held its
// part the longest leaves.
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
    /// Bytes that may wait to be sent, over all connections.
    std::size_t held_bytes_max = std::size_t{64} << 20;

    /// These limits, or fewer in the same proportions when the process may open only so many
    /// descriptors. At least 8 of a kind.
    [[nodiscard]] DoorLimits within(std::size_t descriptors) const;
    /// The descriptors that the process needs for them and for everything else: files, the journal,
    /// live streams.
    [[nodiscard]] std::size_t descriptors() const;
};

class Door {
  public:
    using Id = std::uint64_t;
    /// The connection that has to leave, if one has to. The door has forgotten it; the caller
    /// closes it.
    using Leaver = std::optional<Id>;

    explicit Door(DoorLimits limits = {}) : limits_(limits) {}

    /// A stranger from `address` arrives, and gets a place.
    [[nodiscard]] Leaver enter(Id id, std::string address, Instant now);
    /// It has shown the key, or (false) a wrong one.
    [[nodiscard]] Leaver set_known(Id id, bool known);
    /// It begins a request, or (false) waits for the next one. The second makes it young again.
    void set_busy(Id id, bool busy, Instant now);
    /// This many bytes wait to be sent to it; 0: none.
    [[nodiscard]] Leaver set_held(Id id, std::size_t bytes, Instant now);
    /// Makes room although no limit asks for it: the process cannot open another socket. Nothing
    /// when all that are left are known and busy.
    [[nodiscard]] Leaver make_room();
    void leave(Id id) { static_cast<void>(drop(id)); }

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
    // The first in order leaves first; of strangers the bool is false.
    using Order = std::set<std::tuple<bool, Instant, Id>>;

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
