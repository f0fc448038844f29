#include "bench/rig/child.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/host_settings.h"

namespace qduino::bench {
namespace {

using board::linux::monotonic_now;

constexpr Nanoseconds kGrace = 3s;
volatile std::sig_atomic_t stop_asked = 0;

void watch_signals() {
    struct sigaction action {};
    action.sa_handler = [](int) { stop_asked = 1; };
    sigemptyset(&action.sa_mask);
    ::sigaction(SIGINT, &action, nullptr);
    ::sigaction(SIGTERM, &action, nullptr);
}

/// Limits how long this process, and what it starts, may run at real-time priority without a
/// wait.
void limit_spins(Nanoseconds longest) {
    const auto us = static_cast<rlim_t>(longest / 1us);
    const rlimit limit{us, us};
    ::setrlimit(RLIMIT_RTTIME, &limit);
}

std::string how_it_ended(int status) {
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
    if (WIFEXITED(status)) return "ended with status " + std::to_string(WEXITSTATUS(status));
    return std::string{"was ended by "} + ::strsignal(WTERMSIG(status));
}

/// Waits for `child`; see run_child().
std::string wait_for(pid_t child, Nanoseconds limit, const std::function<void()>& meanwhile) {
    Instant patience = monotonic_now() + limit;
    int asked_to_end = 0;
    int status = 0;
    while (::waitpid(child, &status, WNOHANG) == 0) {
        if (monotonic_now() > patience || (stop_asked && asked_to_end == 0)) {
            ::kill(child, asked_to_end++ == 0 ? SIGTERM : SIGKILL);
            patience = monotonic_now() + kGrace;
        }
        if (meanwhile) meanwhile();
        ::usleep(20000);
    }
    if (meanwhile) meanwhile();
    // A user who may not read the record of changes has made none.
    const auto restored = board::linux::restore_settings(board::linux::kDefaultSettingsState);
    if (!restored && restored.error().code != ErrorCode::not_permitted)
        return "left the computer changed: " + std::string(restored.error().message.view());
    return how_it_ended(status);
}

}  // namespace

int cannot(const Error& why) {
    std::fprintf(stderr, "%s\n", std::string{why.message.view()}.c_str());
    return 1;
}

bool interrupted() { return stop_asked != 0; }

std::string run_child(const std::function<int()>& work, Nanoseconds limit,
                      const std::function<void()>& meanwhile) {
    watch_signals();
    const pid_t parent = ::getpid();
    const pid_t child = ::fork();
    if (child < 0) return std::string{"no process to be had: "} + std::strerror(errno);
    if (child == 0) {
        ::signal(SIGINT, SIG_IGN);  // Ctrl-C reaches the whole group: the parent decides
        ::signal(SIGTERM, SIG_DFL);
        ::prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (::getppid() != parent) ::_exit(1);
        limit_spins(limit + 2 * kGrace);
        ::_exit(work());
    }
    return wait_for(child, limit, meanwhile);
}

std::string program_beside(const std::string& name) {
    char path[PATH_MAX];
    const ssize_t size = ::readlink("/proc/self/exe", path, sizeof path - 1);
    const std::string self{path, size > 0 ? static_cast<std::size_t>(size) : 0};
    return self.substr(0, self.rfind('/') + 1) + name;
}

std::string run_program(const std::vector<std::string>& command, Nanoseconds limit,
                        const std::string& log_path, const std::function<void()>& meanwhile) {
    const std::string program = program_beside(command.front());
    if (::access(program.c_str(), X_OK) != 0) return program + " is not built";
    std::vector<char*> arguments;
    for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const auto start = [&] {
        const int log = ::open(log_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
        if (log >= 0) {
            ::dup2(log, STDERR_FILENO);
            ::dup2(log, STDOUT_FILENO);
        }
        ::execv(program.c_str(), arguments.data());
        return 127;
    };
    std::string failure = run_child(start, limit, meanwhile);
    if (!failure.empty()) failure = command.front() + " " + failure + "; see " + log_path;
    return failure;
}

}  // namespace qduino::bench
