#include "vcpu/tree_run.h"

#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>

#include "board/linux/kernel/clock.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::apps {
namespace {

using board::linux::monotonic_now;
using posix::UniqueFd;

constexpr Nanoseconds kGrace = 2s;
constexpr int kNotRunnable = 126, kCommandNotFound = 127;
constexpr int kCannotEnter = 125;

/// The tree's side: becomes the command, or says why not. `told` ends without a word by exec(2).
[[noreturn]] void become_command(const ProcessVcpu& vcpu, const std::vector<std::string>& command,
                                 const sigset_t& mask, pid_t keeper, int told) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != keeper) ::_exit(kCannotEnter);
    if (const Result<void> entered = vcpu.group().enter(vcpu.tree().core); !entered) {
        const std::string_view why = entered.error().message.view();
        static_cast<void>(!::write(told, why.data(), why.size()));
        ::_exit(kCannotEnter);
    }
    ::sigprocmask(SIG_SETMASK, &mask, nullptr);
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    ::execvp(words[0], words.data());
    const int error = errno;
    std::fprintf(stderr, "qduino: %s cannot be run: %s\n", words[0], std::strerror(error));
    ::_exit(error == ENOENT ? kCommandNotFound : kNotRunnable);
}

int status_of(int wait_status) {
    return WIFSIGNALED(wait_status) ? 128 + WTERMSIG(wait_status) : WEXITSTATUS(wait_status);
}

/// The tree from its start to its end, as its keeper sees it.
class Tree {
  public:
    Tree(const ProcessVcpu& vcpu, pid_t command, int signals, std::function<void()> on_daemons)
        : vcpu_(vcpu), command_(command), signals_(signals), on_daemons_(std::move(on_daemons)) {}

    /// The command's status, when all of the tree has ended.
    int await() {
        while (!reap()) {
            const bool daemons_are_left = status_.has_value();
            if (daemons_are_left && asked_) end_daemons();
            pollfd readable{signals_, POLLIN, 0};
            if (::poll(&readable, 1, asked_ ? kLookEveryMs : -1) > 0) take_signal();
        }
        return status_.value_or(0);
    }

  private:
    static constexpr int kLookEveryMs = 50;

    /// True when no process is left. Orphans of the tree become this process's children.
    bool reap() {
        for (;;) {
            int wait_status = 0;
            const pid_t ended = ::waitpid(-1, &wait_status, WNOHANG);
            if (ended < 0 && errno == ECHILD) return true;
            if (ended <= 0) break;
            if (ended == command_) status_ = status_of(wait_status);
        }
        if (status_ && !asked_ && !told_) {
            told_ = true;
            on_daemons_();
        }
        return false;
    }

    void take_signal() {
        signalfd_siginfo came{};
        if (::read(signals_, &came, sizeof came) != sizeof came || came.ssi_signo == SIGCHLD) return;
        const int signal = static_cast<int>(came.ssi_signo);
        asked_ = asked_ || signal == SIGINT || signal == SIGTERM || signal == SIGHUP || signal == SIGQUIT;
        const bool terminals = came.ssi_code == SI_KERNEL;  // the command has it already
        if (!status_ && !terminals) ::kill(command_, signal);
    }

    void end_daemons() {
        const std::string& group = vcpu_.group().folders()[0];
        if (!kill_at_) {
            board::linux::signal_group(group, SIGTERM);
            kill_at_ = monotonic_now() + kGrace;
        } else if (monotonic_now() >= *kill_at_) {
            board::linux::signal_group(group, SIGKILL);
        }
    }

    const ProcessVcpu& vcpu_;
    pid_t command_;
    int signals_;
    std::function<void()> on_daemons_;
    std::optional<int> status_;  // of the command, once it has ended
    bool asked_ = false;         // to end
    bool told_ = false;
    std::optional<Instant> kill_at_;
};

/// From here on they are read from the result. Those that a shell or nohup has made this process
/// ignore stay ignored: the command inherits that.
UniqueFd watch_signals() {
    sigset_t watched;
    sigemptyset(&watched);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGUSR1, SIGUSR2, SIGCHLD}) {
        struct sigaction present {};
        ::sigaction(signal, nullptr, &present);
        if (present.sa_handler != SIG_IGN || signal == SIGCHLD) sigaddset(&watched, signal);
    }
    ::sigprocmask(SIG_BLOCK, &watched, nullptr);
    return UniqueFd{::signalfd(-1, &watched, SFD_CLOEXEC)};
}

/// What the child says before exec(2); empty: it runs.
std::string complaint(int pipe) {
    std::array<char, 256> bytes{};
    ssize_t got = 0;
    do {
        got = ::read(pipe, bytes.data(), bytes.size());
    } while (got < 0 && errno == EINTR);
    return {bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0))};
}

}  // namespace

Result<TreeEnd> run_tree(const ProcessVcpu& vcpu, const std::vector<std::string>& command,
                         const std::function<void()>& on_daemons) {
    sigset_t before;
    ::sigprocmask(SIG_SETMASK, nullptr, &before);
    const UniqueFd signals = watch_signals();
    if (!signals.valid()) return posix::system_error("watch", "signals");
    ::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0);
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) return posix::system_error("make", "a pipe");
    const UniqueFd told{ends[0]};
    UniqueFd tell{ends[1]};
    const Instant start = monotonic_now();
    const pid_t keeper = ::getpid();
    const pid_t child = ::fork();
    if (child < 0) return posix::system_error("start", command[0]);
    if (child == 0) become_command(vcpu, command, before, keeper, tell.get());
    tell.reset();
    const std::string wrong = complaint(told.get());
    Tree tree{vcpu, child, signals.get(), on_daemons};
    const int status = tree.await();
    if (!wrong.empty())
        return make_error(ErrorCode::unavailable, "the command could not enter its VCPU: ", wrong);
    return TreeEnd{.status = status, .lasted = monotonic_now() - start};
}

}  // namespace qduino::apps
