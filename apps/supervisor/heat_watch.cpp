#include "apps/supervisor/heat_watch.h"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/host_settings.h"
#include "board/linux/kernel/importance.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/system_error.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::supervisor {
namespace {

using board::SketchDeath;
using board::linux::block_until;
using board::linux::monotonic_now;
using posix::system_error;
using posix::UniqueFd;

constexpr Nanoseconds kLook = 20ms;
constexpr int kSilentLooks = 50;
constexpr int kDeadLooks = 3;
constexpr long kDescriptorsMax = 1024;  // far more than a supervisor opens

UniqueFd pidfd_of(pid_t process) { return UniqueFd{static_cast<int>(::syscall(SYS_pidfd_open, process, 0))}; }

/// True when the process behind the descriptor is dead.
bool is_gone(const UniqueFd& process) {
    pollfd watched{process.get(), POLLIN, 0};
    return ::poll(&watched, 1, 0) > 0 && (watched.revents & POLLIN) != 0;
}

/// Closes what the supervisor opened, because its lock on the pins must end with it. The mappings
/// stay. Descriptors that the supervisor was started with stay open here, too: these locks tell
/// whether any process of the printer lives (apps/launcher).
void close_supervisors_own() {
    const long descriptors = ::sysconf(_SC_OPEN_MAX);
    for (int fd = STDERR_FILENO + 1; fd < std::min(descriptors, kDescriptorsMax); ++fd) {
        const int flags = ::fcntl(fd, F_GETFD);
        if (flags >= 0 && (flags & FD_CLOEXEC) != 0) ::close(fd);
    }
}

/// The whole of the child.
class Watcher {
  public:
    Watcher(const HeatWatchTask& task, HeatWatchPage& page, SafeHands& hands, pid_t supervisor)
        : task_(task), page_(page), hands_(hands), supervisor_(supervisor) {}

    void prepare() {
        board::linux::name_thread("heat-watch");
        sigset_t all;  // a terminal's Ctrl-C is the supervisor's business
        sigfillset(&all);
        sigdelset(&all, SIGXCPU);
        ::sigprocmask(SIG_SETMASK, &all, nullptr);
        close_supervisors_own();
        supervisor_alive_ = pidfd_of(supervisor_);
        if (task_.real_time) importance::rise(importance::kHeatWatchPriority);
    }

    void watch() {
        for (;;) {
            block_until(monotonic_now() + kLook);
            follow_sketch();
            if (supervisor_is_gone()) return leave();
            if (is_silent()) {
                // If the supervisor spins, the processes that it waits for can run now.
                const sched_param ordinary{};
                ::sched_setscheduler(supervisor_, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
                cut_and_go_on("the supervisor fell silent; the heat watch has switched the machine off");
            } else if (is_left_lying()) {
                cut_and_go_on(
                    "the supervisor did not see it die; the heat watch has switched the machine off");
            }
        }
    }

  private:
    bool supervisor_is_gone() const {
        return ::getppid() != supervisor_ || (supervisor_alive_.valid() && is_gone(supervisor_alive_));
    }

    void follow_sketch() {
        const pid_t now = page_.sketch.load();
        if (now == sketch_) return;
        sketch_ = now;
        process_ = now != 0 ? pidfd_of(now) : UniqueFd{};
        dead_looks_ = silent_looks_ = 0;
        hands_.release_lines();  // the next one needs them
    }

    bool may_cut() const { return sketch_ != 0 && page_.cut.load() != sketch_; }

    bool is_silent() {
        const std::uint64_t beats = page_.beats.load(std::memory_order_relaxed);
        const bool quiet = page_.beating.load() != 0 && beats == beats_;
        beats_ = beats;
        silent_looks_ = quiet ? silent_looks_ + 1 : 0;
        return silent_looks_ >= kSilentLooks && may_cut();
    }

    bool is_left_lying() {
        const bool dead = may_cut() && is_gone(process_) && task_.file->layout().sketch_dead.load() == 0;
        dead_looks_ = dead ? dead_looks_ + 1 : 0;
        return dead_looks_ >= kDeadLooks;
    }

    void cut_and_go_on(const char* why) {
        cut(why);
        if (task_.real_time) importance::rise(importance::kHeatWatchPriority);
    }

    /// At ordinary priority when it returns.
    void cut(const char* why) {
        system_.kill(process_.get(), SIGKILL);
        const Dying dying{process_.get(), sketch_};
        SafeHands::Cut done = hands_.cut(dying, SketchDeath::hung);
        page_.cut = sketch_;
        importance::step_down();
        if (process_.valid()) hands_.outlast(dying, done);
        if (!task_.link.empty()) write_death_note(task_.link, sketch_, why);
        static_cast<void>(board::linux::restore_settings(task_.settings_state));
        apps::say(text<std::string>("sketch ", sketch_, ": ", why, "; ",
                                    apps::counted(done.outputs.pins, "pin"), " forced to safe states"),
                  "qduino-supervisor: ");
    }

    /// The supervisor is dead. It may have died at any point of its work for the last sketch, so
    /// all of that work is done again.
    void leave() {
        if (sketch_ != 0) cut("the supervisor died; the heat watch has switched the machine off");
    }

    const HeatWatchTask& task_;
    HeatWatchPage& page_;
    SafeHands& hands_;
    SystemCalls system_;
    pid_t supervisor_;
    UniqueFd supervisor_alive_;
    pid_t sketch_ = 0;
    UniqueFd process_;
    std::uint64_t beats_ = 0;
    int silent_looks_ = 0;
    int dead_looks_ = 0;
};

}  // namespace

Result<void> HeatWatch::start(const HeatWatchTask& task) {
    if (!page_) {
        QDUINO_TRY_ASSIGN(memory_, posix::map_anonymous(sizeof(HeatWatchPage)));
        page_ = memory_.as<HeatWatchPage>();
    }
    QDUINO_TRY(hands_.open(*task.file, board::kHeatWatchWriter, task.link, task.sysfs_root, system_));
    const pid_t supervisor = ::getpid();
    pid_ = ::fork();
    if (pid_ < 0) return system_error("start", "the heat watch");
    if (pid_ == 0) {
        Watcher watcher{task, *page_, hands_, supervisor};
        watcher.prepare();
        watcher.watch();
        ::_exit(0);
    }
    pidfd_ = pidfd_of(pid_);
    if (pidfd_.valid()) return {};
    const Error failed = system_error("watch", "the heat watch");
    end();
    return failed;
}

void HeatWatch::end() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    pid_ = -1;
    pidfd_.reset();
}

}  // namespace qduino::supervisor
