// Whose TLS handshake is next. No sockets: time and names are parameters.
//
// A handshake costs the service 0.3 ms and some 40 KB, and a stranger a few bytes. The service has
// 10 ms in each 100 ms. So strangers without number must not take more than a part of it, and one
// must not take what another needs:
//
//   waiting     has sent its first byte; holds a place at the door (door.h), and no memory
//      │        one turn after the other, the addresses in rotation, 100 each second
//      ▼
//   under way   64 places, 48 for one address; a newcomer takes the place of the oldest handshake
//      │        of the address that has the most
//      ▼
//   over        an ordinary connection; the key is asked for
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

#include "base/time.h"
#include "web/http/door.h"

namespace qduino::web {

class Handshakes {
  public:
    using Id = Door::Id;
    static constexpr int kBurst = 32;
    static constexpr Nanoseconds kEvery = std::chrono::milliseconds{10};

    struct Turn {
        Id id = 0;
        Door::Leaver leaver;  ///< the handshake that has to end for it
    };

    /// A connection from `address` asks for its turn.
    void wait(Id id, const std::string& address);
    /// Whose turn it is now; nothing while nobody waits, or it is too early.
    [[nodiscard]] std::optional<Turn> next(Instant now);
    /// It is over, or its connection has ended, wherever it stood.
    void leave(Id id);

    [[nodiscard]] bool is_waited_for() const { return !address_of_.empty(); }

  private:
    Door under_way_{{.strangers_max = 64, .strangers_of_address_max = 48}};
    std::map<std::string, std::deque<Id>> waiting_;  // by address; none of them is empty
    std::map<Id, std::string> address_of_;           // of those that wait
    std::string served_last_;                        // address
    Instant scheduled_{};  // the turns given so far, at one each kEvery, last until then
};

}  // namespace qduino::web
