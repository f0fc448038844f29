#include "apps/terminal/program.h"

#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <atomic>

#include "apps/terminal/message.h"

namespace qduino::apps {
namespace {

std::atomic<bool> g_stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");
unsigned g_patience_s = 0;

}  // namespace

int Fail::operator()(std::string_view message) const {
    say(message, prefix);
    return status;
}

void stop_on_signals(unsigned patience_s) {
    g_patience_s = patience_s;
    struct sigaction action {};
    action.sa_handler = [](int) {
        g_stop_asked = true;
        if (g_patience_s > 0) ::alarm(g_patience_s);
    };
    for (const int signal : {SIGTERM, SIGINT}) ::sigaction(signal, &action, nullptr);
}

bool stop_asked() { return g_stop_asked; }

int block_and_watch(std::initializer_list<int> signals) {
    sigset_t watched;
    sigemptyset(&watched);
    for (const int signal : signals) sigaddset(&watched, signal);
    ::sigprocmask(SIG_BLOCK, &watched, nullptr);
    return ::signalfd(-1, &watched, SFD_CLOEXEC);
}

}  // namespace qduino::apps
