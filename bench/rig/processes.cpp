#include "bench/rig/processes.h"

#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdint>
#include <cstdio>

namespace qduino::bench {
namespace {

constexpr int kPriority = 95;

void take_priority(int policy, int priority) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    ::sched_setscheduler(0, policy | SCHED_RESET_ON_FORK, &parameters);
}

}  // namespace

pid_t start_quietly(const std::vector<std::string>& words, const std::string& output) {
    std::vector<char*> arguments;
    for (const auto& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    const pid_t child = ::fork();
    if (child != 0) return child;
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (std::freopen(output.c_str(), "w", stdout) && ::dup2(STDOUT_FILENO, STDERR_FILENO) >= 0)
        ::execv(arguments[0], arguments.data());
    ::_exit(127);
}

Busy::Busy(int count) {
    for (int i = 0; i < count; ++i) {
        const pid_t child = ::fork();
        if (child != 0) {
            children_.push_back(child);
            continue;
        }
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        static volatile std::uint64_t counted = 0;
        for (;;) counted = counted + 1;
    }
}

Busy::~Busy() {
    for (const pid_t child : children_) {
        ::kill(child, SIGKILL);
        ::waitpid(child, nullptr, 0);
    }
}

AboveAll::AboveAll() { take_priority(SCHED_FIFO, kPriority); }
AboveAll::~AboveAll() { take_priority(SCHED_OTHER, 0); }

}  // namespace qduino::bench
