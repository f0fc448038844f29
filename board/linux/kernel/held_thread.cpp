#include "board/linux/kernel/held_thread.h"

#include <sched.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/wait.h>

#include <cstdint>

#include "board/linux/kernel/clock.h"

namespace qduino::board::linux {

namespace {

/// ptrace(2) takes the number of a signal in place of an address.
void* number_as_address(int number) { return reinterpret_cast<void*>(static_cast<std::intptr_t>(number)); }

bool is_stop_of_ours(int status) { return status >> 16 == PTRACE_EVENT_STOP; }

}  // namespace

void HeldThread::demote(pid_t tid) {
    const sched_param ordinary{};
    // With the flag: an ordinary user may not take it away, and would be refused the whole call.
    ::sched_setscheduler(tid, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
}

void HeldThread::promote(const ThreadPlace& place) {
    sched_param parameters{};
    parameters.sched_priority = place.priority;
    ::sched_setscheduler(place.tid, (place.priority > 0 ? SCHED_FIFO : SCHED_OTHER) | SCHED_RESET_ON_FORK,
                         &parameters);
}

void HeldThread::hold() {
    to_be_held_ = true;
    if (held()) return;
    signal_ = 0;
    const bool seized = ::ptrace(PTRACE_SEIZE, place_.tid, nullptr, nullptr) == 0;
    if (seized) ::ptrace(PTRACE_INTERRUPT, place_.tid, nullptr, nullptr);
    demote(place_.tid);
    state_ = seized ? State::stopping : State::demoted;
}

void HeldThread::release() {
    to_be_held_ = false;
    if (state_ == State::stopped || state_ == State::demoted) let_go();
}

void HeldThread::let_go() {
    promote(place_);
    if (state_ == State::stopped) ::ptrace(PTRACE_DETACH, place_.tid, nullptr, number_as_address(signal_));
    state_ = State::free;
}

void HeldThread::changed(int status) {
    if (!WIFSTOPPED(status)) {  // it has ended
        state_ = State::free;
        return;
    }
    if (state_ != State::stopping) return;
    signal_ = is_stop_of_ours(status) ? 0 : WSTOPSIG(status);
    state_ = State::stopped;
    if (!to_be_held_) let_go();
}

bool HeldThread::put_back() const {
    sched_param parameters{};
    const int policy = ::sched_getscheduler(place_.tid);
    cpu_set_t cores;
    CPU_ZERO(&cores);
    if (policy < 0 || ::sched_getparam(place_.tid, &parameters) != 0 ||
        ::sched_getaffinity(place_.tid, sizeof cores, &cores) != 0)
        return false;  // it has ended
    const int without_flag = policy & ~SCHED_RESET_ON_FORK;
    // An ordinary thread may have stepped back by itself (budget_keeper.h). It takes nothing.
    const bool rank = without_flag == SCHED_OTHER ||
                      (without_flag == SCHED_FIFO && parameters.sched_priority == place_.priority);
    const bool core = CPU_COUNT(&cores) == 1 && CPU_ISSET(static_cast<std::size_t>(place_.core), &cores);
    if (!rank) promote(place_);
    if (!core) {
        CPU_ZERO(&cores);
        CPU_SET(static_cast<std::size_t>(place_.core), &cores);
        if (::sched_setaffinity(place_.tid, sizeof cores, &cores) != 0) return !rank;
    }
    return !rank || !core;
}

bool HeldThread::can_be_stopped() {
    constexpr int kLooks = 50;
    if (::ptrace(PTRACE_SEIZE, place_.tid, nullptr, nullptr) != 0) return false;
    ::ptrace(PTRACE_INTERRUPT, place_.tid, nullptr, nullptr);
    state_ = State::stopping;
    to_be_held_ = false;
    for (int look = 0; look < kLooks && held(); ++look) {
        int status = 0;
        if (::waitpid(place_.tid, &status, __WALL | WNOHANG) == place_.tid) {
            changed(status);
        } else {
            block_until(monotonic_now() + 1ms);
        }
    }
    return true;  // otherwise it stops later, and is let go then
}

}  // namespace qduino::board::linux
