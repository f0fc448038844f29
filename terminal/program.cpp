#include "terminal/program.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <atomic>

#include "terminal/message.h"

namespace qduino::apps {
namespace {

std::atomic<bool> g_stop_asked{false};
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler writes it");

}  // namespace

int Fail::operator()(std::string_view message) const {
    say(message, prefix);
    return status;
}

void stop_on_signals() {
    struct sigaction action {};
    action.sa_handler = [](int) { g_stop_asked = true; };
    for (const int signal : {SIGTERM, SIGINT}) ::sigaction(signal, &action, nullptr);
}

bool stop_asked() { return g_stop_asked; }
void ask_to_stop() { g_stop_asked = true; }

void keep_standard_descriptors() {
    for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
        if (::fcntl(descriptor, F_GETFD) >= 0) continue;
        // The lowest that is free is this one. Open the other way round: not to be used.
        static_cast<void>(::open("/dev/null", descriptor == STDIN_FILENO ? O_WRONLY : O_RDONLY));
    }
}

int block_and_watch(std::initializer_list<int> signals) {
    sigset_t watched;
    sigemptyset(&watched);
    for (const int signal : signals) sigaddset(&watched, signal);
    ::sigprocmask(SIG_BLOCK, &watched, nullptr);
    return ::signalfd(-1, &watched, SFD_CLOEXEC);
}

}  // namespace qduino::apps
