// Outlives the sketch, and makes the machine safe when the sketch no longer can.
//
//   supervisor  ──fork, exec──► sketch
//       │  is it dead (pidfd: known at once)?  has a loop broken its promise (heartbeats in the pins file, every 10 ms)?
//       │
//       ├─ a promise is broken ──► SIGKILL: a sketch that hangs cannot be reasoned with
//       └─ it is dead ──► 1. force every pin that has a safe state   (virtual: edges of the supervisor's own ring;
//                                                                      real: the lines are requested anew)
//                         2. say so: sketch_dead in the pins file and in the link to the service
//                         3. put the machine's settings back
//                         4. leave with the sketch's status, or start it again
//
// The bound of the design is 100 ms, from death or from the broken promise to step 1. A death wakes the supervisor; a broken
// promise is seen within kPollMs, and the killed sketch is waited for at most kKillWaitMs. (How long a loop may be silent before its
// promise is broken is another matter: --timeout-ms, and LinuxConfig::heartbeat_bound.) Measured on a loaded 2-core virtual machine:
// 2 ms after a kill, 7 ms after a missed heartbeat; tests/scenario/supervisor prints it.
#pragma once

#include <string>
#include <vector>

#include "apps/supervisor/sketch_process.h"
#include "base/result.h"
#include "base/time.h"
#include "board/linux/machine_settings.h"
#include "board/linux/pin_writer.h"
#include "board/linux/pins_file.h"

namespace qduino::supervisor {

struct Options {
    std::string pins;                    ///< file of virtual pins
    std::string link;                    ///< link between sketch and service; empty: none
    Nanoseconds heartbeat_timeout = 1s;  ///< zero: loops are not watched
    std::string settings_state =
        board::linux::kDefaultSettingsState;  ///< what the sketch changed on the machine
    bool restart = false;                     ///< start the sketch again when it died or hung
    bool make_pins = false;                   ///< no virtual machine: make the file (real pins only)
    std::vector<std::string> command;         ///< the sketch and its arguments
};

class Supervisor {
  public:
    /// Opens the pins file and takes the supervisor's role on it. Errors: PinsFile::open.
    static Result<Supervisor> open(Options options);

    /// Runs the sketch to its end (with `restart`: until it ends well or a stop is asked for). `signals` is a
    /// signalfd that carries SIGTERM and SIGINT, which are handed on to the sketch. Returns the exit status.
    int run(int signals);

  private:
    enum class Outcome { ended, hung };
    struct Watched {
        Outcome outcome = Outcome::ended;
        Ending ending;
        board::VcpuId hung_loop = 0;
        Nanoseconds overdue{};  ///< of the hung loop, when it was noticed
    };

    Supervisor() = default;
    Watched watch(const SketchProcess& sketch, int signals);
    /// The loop whose promise is overdue; kNoVcpu: none.
    [[nodiscard]] board::VcpuId overdue_loop(Instant now) const;
    void make_safe(const Watched& watched, pid_t sketch);
    void put_machine_back() const;
    void report(const Watched& watched, pid_t sketch, int pins, int lines_failed, Nanoseconds took) const;

    Options options_;
    board::linux::PinsFile machine_role_;  // with make_pins
    board::linux::PinsFile file_;
    board::linux::PinWriter writer_;
    std::vector<board::linux::UniqueFd> lines_;  // taken over from a dead sketch
    bool stop_asked_ = false;
};

/// Says in the link that its sketch is dead. Nothing happens when there is no such link or it is another sketch's.
void mark_link_dead(const std::string& path, pid_t sketch, bool hung);

}  // namespace qduino::supervisor
