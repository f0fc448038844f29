// Outlives the sketch, and makes the machine safe when the sketch no longer can.
//
//   supervisor ──fork──► heat watch    cuts the heat when this process cannot (heat_watch.h, with a
//       │                              table of all deaths)
//       │      ──fork, exec──► sketch
//       │
//       │  every 10 ms, or woken by its pidfd: is the sketch dying (its death witness in the pins
//       │  file)? dead? has a loop broken its promise (heartbeats)? is who started the supervisor
//       │  dead (starter.h)?
//       │
//       ├─ a promise is broken, or its warden does not look (hang.h)
//       │                                 ──► SIGKILL: a sketch that hangs cannot be reasoned with
//       ├─ its starter is dead ──► SIGKILL: to stop in order takes the sketch's longest period
//       └─ it is dead or dying ──► at real-time priority:
//                                  1. force every output that has a safe state
//                                  2. set sketch_dead in the pins file and in the service's link
//                                  3. let its threads die, also behind a task that spins on their
//                                     core (dying_threads.h): 100 ms at most
//                                  4. back to ordinary scheduling; then, at ordinary priority:
//                                  5. the explanation, with who took its core: the link's death
//                                     note. Reap it
//                                  6. put the computer's settings back, report
//                                  7. leave with the sketch's status, or start it again
//
// Nothing before step 4 can wait for an ordinary process, and nothing spins: importance.h lists the
// bounds.
//
// The bound of the design is 100 ms, from death or from the broken promise to step 1. bench/safety
// measures it from outside. (How long a loop may be silent before its promise counts as broken is
// another matter: --timeout-ms, and LinuxConfig::heartbeat_bound.)
#pragma once

#include <string>
#include <vector>

#include "apps/supervisor/hang.h"
#include "apps/supervisor/heat_watch.h"
#include "apps/supervisor/safe_hands.h"
#include "apps/supervisor/sketch_process.h"
#include "apps/supervisor/system_calls.h"
#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/pin/pins_file.h"
#include "board/linux/pin/starter.h"
#include "posix/unique_fd.h"

namespace qduino::supervisor {

struct Options {
    std::string pins;                    ///< file of virtual pins
    std::string link;                    ///< link between sketch and service; empty: none
    Nanoseconds heartbeat_timeout = 1s;  ///< zero: loops are not watched
    /// The record of what the sketch changed on the computer.
    std::string settings_state = board::linux::kDefaultSettingsState;
    std::string sysfs_root;  ///< precedes /sys (tests)
    std::string starter;     ///< the word of who started it (starter.h); empty: none
    bool restart = false;    ///< start the sketch again when it died or hung
    /// No virtual machine: make the file (real pins only).
    bool make_pins = false;
    /// Watch at a priority above every loop, where that is allowed.
    bool real_time = false;
    std::vector<std::string> command;  ///< the sketch and its arguments
};

class Supervisor {
  public:
    /// Opens the pins file and takes the supervisor's role on it. `system` outlives it. Errors:
    /// PinsFile::open, Starter::open.
    static Result<Supervisor> open(Options options, SystemCalls& system);

    /// Runs the sketch to its end (with `restart`: until it ends well or a stop is asked for).
    /// `signals` is a signalfd with SIGTERM and SIGINT, which are handed on to the sketch; −1:
    /// none. One thread. Returns the exit status.
    int run(int signals);

  private:
    enum class Outcome { ended, hung, orphaned };
    struct Watched {
        Outcome outcome = Outcome::ended;
        Ending ending;
        Hang hang;
        Instant ended_at;  ///< when the hang, or the end, was noticed
        SafeHands::Cut cut;
        /// The real-time task that has a core of the sketch; empty: none was found.
        std::string core_taken;
    };

    explicit Supervisor(SystemCalls& system) : system_(&system) {}
    int keep_running(int signals);
    void start_heat_watch();
    void renew_heat_watch();
    Watched watch(const SketchProcess& sketch, int signals);
    void hand_on_signal(const SketchProcess& sketch, int signals, Instant& kill_at);
    /// True when it is dead, or all its threads are about to be.
    [[nodiscard]] bool is_dying(const SketchProcess& sketch) const;
    [[nodiscard]] Hang find_hang_now(Instant now);
    void outlive(Watched& watched, const SketchProcess& sketch);
    [[nodiscard]] std::string find_who_took_its_core(const Watched& watched,
                                                     const SketchProcess& sketch) const;
    [[nodiscard]] static std::string how_it_ended(const Watched& watched);
    void explain(const Watched& watched, pid_t sketch) const;
    void put_computer_back() const;
    void report(const Watched& watched, pid_t sketch) const;

    Options options_;
    SystemCalls* system_;
    board::linux::PinsFile machine_role_;  // with make_pins
    board::linux::PinsFile file_;
    board::linux::Starter starter_;
    SafeHands hands_;
    HeatWatchTask heat_watch_task_;
    HeatWatch heat_watch_;
    Instant renew_heat_watch_at_ = kEpoch;
    bool stop_asked_ = false;
    posix::UniqueFd warden_;        // of the sketch: readable once it is dead
    std::uint32_t warden_pid_ = 0;  // 0: it has none yet
    int turns_unwatched_ = 0;
    Pauses pauses_;  // of this process, while it watches the sketch
};

/// The program qduino-supervisor without its main(): tests run it on a system of their own. Returns
/// the exit status.
int run_command_line(int argc, char** argv, SystemCalls& system);

}  // namespace qduino::supervisor
