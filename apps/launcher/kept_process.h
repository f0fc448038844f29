// One process of the printer: started, found ready, ended, started again.
//
//   start ──► running ──(ready?)──► ready ──► ended ──► pause ──► start …
//                                                restart_policy.h says whether it starts again
//
// It dies with the launcher: the kernel then sends it SIGTERM (PR_SET_PDEATHSIG), on which every
// program of the printer makes itself safe and ends. It has a process group of its own, so that
// Ctrl-C in the terminal goes to the launcher alone, which stops everything in order.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "apps/launcher/restart_policy.h"
#include "apps/launcher/run_log.h"
#include "base/result.h"
#include "base/time.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

struct ProcessPlan {
    std::string name;  ///< as a person reads it
    std::vector<std::string> command;
    /// True once it has come up; called again and again. `output` is its first line so far, when
    /// `read_line`.
    std::function<bool(const std::string& output)> ready;
    bool read_line = false;  ///< its standard output is read up to the first line, and not shown
    /// Where else it speaks, and what is said of it goes; outlives it.
    const RunLog* log = nullptr;
    /// A file that is locked while it or one of its children lives; empty: none.
    std::filesystem::path locks;
    std::function<bool()> may_start = [] { return true; };  ///< what it needs is there
    std::function<void()> after_end = [] {};
    /// Before each start, in this process. An error: it is tried again later.
    std::function<Result<void>()> before_start = [] { return Result<void>{}; };
    /// The rights of root that the program may have (rights/rights.h).
    std::span<const int> rights;
    /// In the child, before it becomes the program: what it enters.
    std::function<void()> in_child = [] {};
};

class KeptProcess {
  public:
    explicit KeptProcess(ProcessPlan plan) : plan_(std::move(plan)) {}

    enum class State { waiting, running, ready, given_up };

    [[nodiscard]] Result<void> start(Instant now);
    /// Checks whether it has come up, whether it has ended, and whether to start it again. Writes
    /// on stderr what a person should know.
    void advance(Instant now);
    /// Ends it, without haste, and starts it again as soon as it may start.
    void start_anew();
    /// Ends it: asks first, and kills it after `grace`. It is not started again.
    void end(Nanoseconds grace);

    [[nodiscard]] State state() const { return state_; }
    [[nodiscard]] bool alive() const { return pid_ > 0; }
    [[nodiscard]] const std::string& name() const { return plan_.name; }
    [[nodiscard]] const std::string& first_line() const { return line_; }
    [[nodiscard]] const Ended& ended() const { return ended_; }
    /// The end of what was said since it was started last, by it or by others.
    [[nodiscard]] std::string last_words() const;

  private:
    void read_line();
    bool reap(bool wait);
    void on_end(Instant now);
    void say(std::string_view words) const;

    ProcessPlan plan_;
    RestartPolicy policy_;
    State state_ = State::waiting;
    pid_t pid_ = -1;
    posix::UniqueFd output_;
    std::string line_;
    Ended ended_;
    off_t log_from_ = 0;
    Instant started_{};
    Instant again_at_{};
    bool anew_ = false;
};

}  // namespace qduino::launcher
