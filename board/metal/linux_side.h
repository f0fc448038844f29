// Linux, when it runs on the other cores of this computer (board/window/beside_layout.h): its
// heartbeat, its wish to stop, and what it is told.
//
//   keeper's beats   ┃  ┃  ┃  ┃  ┃  ┃                     Linux stands still, or is gone
//   the host looks     ↑    ↑    ↑    ↑    ↑    ↑    ↑
//                                    └─ longer than the limit ─► safe levels, every write to a pin
//                                                                is refused, the run ends
//
// The host looks, above every loop of its core (Core::let_threads_run()). Between looks a loop that
// spins is not touched. Without a limit the run goes on without Linux.
#pragma once

#include <string_view>

#include "base/time.h"
#include "board/window/beside_layout.h"

namespace qduino::board::metal {

class LinuxSide {
  public:
    /// What does not fit into Serial's rings is dropped when Linux was silent for so long.
    static constexpr Nanoseconds kDeaf = 100ms;

    /// First of all, where the loader is Linux's launcher.
    void open(BesideArea& area);
    [[nodiscard]] bool exists() const { return area_ != nullptr; }
    [[nodiscard]] BesideArea& area() const { return *area_; }

    /// How far apart the host's looks are: a fifth of the limit, 10 ms at most.
    [[nodiscard]] Nanoseconds interval() const { return interval_; }
    /// When the host is to look next; kForever: there is no Linux.
    [[nodiscard]] Instant next_look() const { return next_look_; }
    /// By the host. True: the run is to end, for Linux asks for it, or was silent.
    bool look(Instant now);
    /// The run was ended by Linux's silence.
    [[nodiscard]] bool was_silent() const { return was_silent_; }
    /// Nobody takes what Serial says.
    [[nodiscard]] bool is_deaf(Instant now) const;

    /// What does not fit is dropped. False: there is no Linux.
    bool report(std::string_view text);
    /// The last word.
    void tell_end(int status);

  private:
    void drive_safe_levels();

    BesideArea* area_ = nullptr;
    Nanoseconds interval_{};
    Instant next_look_ = kForever;
    Instant last_beat_ = kForever;  // when the host first saw the latest one
    std::uint64_t beats_ = 0;
    bool was_silent_ = false;
};

inline constinit LinuxSide linux_side;

}  // namespace qduino::board::metal
