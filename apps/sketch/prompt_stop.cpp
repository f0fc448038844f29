#include "apps/sketch/prompt_stop.h"

#include <unistd.h>

#include <chrono>
#include <csignal>
#include <system_error>

#include "terminal/program.h"

namespace qduino::apps {
namespace {

constexpr auto kLookEvery = std::chrono::milliseconds{50};
constexpr int kLooksUntilForce = 16;
/// Ignored by default: one that comes late does no harm.
constexpr int kLeave = SIGURG;

board::sim::EventLoop* interrupted_loop = nullptr;

bool ignores_hang_up() {
    struct sigaction present {};
    ::sigaction(SIGHUP, nullptr, &present);
    return present.sa_handler == SIG_IGN;
}

}  // namespace

PromptStop::PromptStop(board::sim::EventLoop& loop, void (*give_up)()) : give_up_(give_up) {
    interrupted_loop = &loop;
    struct sigaction action {};
    action.sa_handler = [](int) { interrupted_loop->leave_soon(); };
    action.sa_flags = SA_RESTART;
    ::sigaction(kLeave, &action, nullptr);
    // The thread takes no signal: each is the run's.
    sigset_t all, before;
    sigfillset(&all);
    ::pthread_sigmask(SIG_SETMASK, &all, &before);
    try {
        thread_ = std::thread([this, runner = ::pthread_self()] { watch(runner); });
    } catch (const std::system_error&) {  // then a stop is seen between two slices
    }
    ::pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

void PromptStop::dismiss() {
    dismissed_ = true;
    if (thread_.joinable()) thread_.join();
    std::signal(kLeave, SIG_IGN);
}

void PromptStop::watch(pthread_t runner) {
    const pid_t parent = ::getppid();
    const bool outlives_it = ignores_hang_up();
    for (int looks = 0; !dismissed_; std::this_thread::sleep_for(kLookEvery)) {
        if (!outlives_it && ::getppid() != parent) ask_to_stop();
        if (!stop_asked()) continue;
        if (++looks > kLooksUntilForce) give_up_();
        ::pthread_kill(runner, kLeave);
    }
}

}  // namespace qduino::apps
