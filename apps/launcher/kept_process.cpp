#include "apps/launcher/kept_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <cstring>
#include <thread>
#include <utility>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/run_lock.h"
#include "posix/system_error.h"
#include "rights/rights.h"
#include "terminal/message.h"

namespace qduino::launcher {
namespace {

using board::linux::monotonic_now;
using posix::system_error;
using posix::UniqueFd;
constexpr Nanoseconds kLookEvery = 20ms;
constexpr std::size_t kLineMax = 4096;

/// Runs in the child. `output` −1: it goes into the log.
[[noreturn]] void become(const ProcessPlan& plan, pid_t launcher, int output) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != launcher) ::_exit(1);  // it died before the request above took hold
    ::setpgid(0, 0);
    sigset_t none;
    sigemptyset(&none);
    ::sigprocmask(SIG_SETMASK, &none, nullptr);
    if (const int nothing = ::open("/dev/null", O_RDONLY); nothing > 0) ::dup2(nothing, STDIN_FILENO);
    if (const int log = plan.log ? plan.log->descriptor() : -1; log >= 0) {
        ::dup2(log, STDOUT_FILENO);
        ::dup2(log, STDERR_FILENO);
    }
    if (output >= 0) ::dup2(output, STDOUT_FILENO);
    plan.in_child();
    if (const Result<void> bound = rights::bound_capabilities(plan.rights); !bound) {
        apps::say(bound.error().message, "run: ");
        ::_exit(1);
    }
    std::vector<char*> arguments;
    for (const std::string& word : plan.command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execv(arguments[0], arguments.data());
    std::fprintf(stderr, "%s cannot be run: %s\n", arguments[0], std::strerror(errno));
    ::_exit(127);
}

}  // namespace

Result<void> KeptProcess::start(Instant now) {
    UniqueFd lock;  // its children's alone: closed here at the end
    if (!plan_.locks.empty()) {
        QDUINO_TRY_ASSIGN(lock, board::linux::lock_file(plan_.locks, Nanoseconds{0}));
    }
    QDUINO_TRY(plan_.before_start());
    UniqueFd to_child;
    if (plan_.read_line) {
        std::array<int, 2> ends{};
        if (::pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return system_error("make", "a pipe");
        output_.reset(ends[0]);
        to_child.reset(ends[1]);
    }
    line_.clear();
    log_from_ = plan_.log ? plan_.log->size() : 0;
    const pid_t launcher = ::getpid();
    pid_ = ::fork();
    if (pid_ < 0) return system_error("start", plan_.command[0]);
    if (pid_ == 0) become(plan_, launcher, to_child.get());
    started_ = now;
    state_ = State::running;
    return {};
}

/// Reads the process's output to the end of its life: a full pipe would stop it. Keeps only the
/// first line.
void KeptProcess::read_line() {
    std::array<char, 512> bytes{};
    while (output_.valid()) {
        const ssize_t got = ::read(output_.get(), bytes.data(), bytes.size());
        if (got <= 0) return;
        const bool whole = !line_.empty() && line_.back() == '\n';
        if (whole || line_.size() > kLineMax) continue;
        line_.append(bytes.data(), static_cast<std::size_t>(got));
        if (const std::size_t end = line_.find('\n'); end != std::string::npos) line_.resize(end + 1);
    }
}

bool KeptProcess::reap(bool wait) {
    int status = 0;
    pid_t done = 0;
    do {
        done = ::waitpid(pid_, &status, wait ? 0 : WNOHANG);
    } while (done < 0 && errno == EINTR);
    if (done != pid_) return false;
    ended_ = {WIFSIGNALED(status), WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status),
              state_ == State::ready};
    pid_ = -1;
    output_.reset();
    return true;
}

void KeptProcess::on_end(Instant now) {
    plan_.after_end();
    if (std::exchange(anew_, false)) {
        state_ = State::waiting;
        return;
    }
    const std::optional<Nanoseconds> pause = policy_.on_end(ended_, now - started_);
    state_ = pause ? State::waiting : State::given_up;
    if (!pause) return;
    again_at_ = now + *pause;
    say(text<std::string>("the ", plan_.name,
                          ended_.by_signal ? " was killed by signal " : " ended with status ", ended_.status,
                          "; starting it again (the log has what it said)"));
}

void KeptProcess::say(std::string_view words) const {
    static const RunLog nowhere;
    (plan_.log ? *plan_.log : nowhere).say(words);
}

std::string KeptProcess::last_words() const { return plan_.log ? plan_.log->since(log_from_) : ""; }

void KeptProcess::advance(Instant now) {
    if (state_ == State::waiting && now >= again_at_ && plan_.may_start()) {
        const Result<void> done = start(now);
        if (done) return;
        // A child of its last life still holds the lock, and is about to end.
        const bool soon = done.error().code == ErrorCode::already_exists;
        again_at_ = now + (soon ? kLookEvery : RestartPolicy::kLastPause);
        if (!soon) say(done.error().message);
        return;
    }
    if (!alive()) return;
    read_line();
    if (state_ == State::running && plan_.ready(line_)) state_ = State::ready;
    if (reap(false)) on_end(now);
}

void KeptProcess::start_anew() {
    if (!alive()) return;
    anew_ = true;
    ::kill(pid_, SIGTERM);
}

void KeptProcess::end(Nanoseconds grace) {
    if (alive()) ::kill(pid_, SIGTERM);
    const Instant until = monotonic_now() + grace;
    while (alive() && !reap(false)) {
        read_line();
        if (monotonic_now() >= until) {
            ::kill(pid_, SIGKILL);
            reap(true);
        } else {
            std::this_thread::sleep_for(kLookEvery);
        }
    }
    if (state_ != State::given_up) plan_.after_end();
    state_ = State::given_up;
}

}  // namespace qduino::launcher
