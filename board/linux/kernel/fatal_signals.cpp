#include "board/linux/kernel/fatal_signals.h"

#include <unistd.h>

#include <array>
#include <atomic>

#include "base/contract.h"

namespace qduino::board::linux {
namespace {

constexpr std::array kFatal{SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
constexpr std::array kStop{SIGINT, SIGTERM, SIGALRM};

Will g_will;
std::atomic<bool> g_will_done{false};
std::atomic<bool> g_stop_asked{false};
std::atomic<bool> g_fatal_seen{false};  // also where the last words themselves crash
std::array<struct sigaction, kFatal.size()> g_fatal_before;
std::array<struct sigaction, kStop.size()> g_stop_before;
ContractHandler g_contract_before = nullptr;

void carry_out_will() {
    if (g_will.last_will && !g_will_done.exchange(true)) g_will.last_will(g_will.context);
}

extern "C" void on_fatal(int signal, siginfo_t* info, void* machine_context) {
    const bool first = !g_fatal_seen.exchange(true);
    carry_out_will();
    if (first && g_will.last_words) g_will.last_words(signal, info, machine_context);
    // Dies of the same signal: the parent sees it, and a core is dumped if asked for.
    ::signal(signal, SIG_DFL);
    ::raise(signal);
}

extern "C" void on_stop(int signal) {
    const bool again = g_stop_asked.exchange(true);
    if (!again && signal != SIGALRM) {
        if (g_will.stop) g_will.stop(g_will.context);
        ::alarm(kStopGraceSeconds);
        return;
    }
    carry_out_will();
    ::_exit(128 + (signal == SIGALRM ? SIGTERM : signal));
}

void on_broken_contract(const char* condition, const char* file, int line) {
    carry_out_will();
    if (g_contract_before) g_contract_before(condition, file, line);
}

void install(int signal, struct sigaction action, int flags, struct sigaction& before) {
    action.sa_flags |= SA_ONSTACK | flags;
    sigemptyset(&action.sa_mask);
    ::sigaction(signal, &action, &before);
}

}  // namespace

FatalSignals::FatalSignals(Will will) {
    QDUINO_EXPECT(g_will.last_will == nullptr);
    g_will = will;
    g_will_done = false;
    g_stop_asked = false;
    g_fatal_seen = false;
    struct sigaction fatal {};
    fatal.sa_sigaction = on_fatal;
    for (std::size_t i = 0; i < kFatal.size(); ++i)
        install(kFatal[i], fatal, SA_RESTART | SA_SIGINFO, g_fatal_before[i]);
    // No SA_RESTART: a stop also ends a wait of setup().
    struct sigaction stop {};
    stop.sa_handler = on_stop;
    for (std::size_t i = 0; i < kStop.size(); ++i) install(kStop[i], stop, 0, g_stop_before[i]);
    g_contract_before = set_contract_handler(on_broken_contract);
}

FatalSignals::~FatalSignals() {
    ::alarm(0);
    set_contract_handler(g_contract_before);
    for (std::size_t i = 0; i < kFatal.size(); ++i) ::sigaction(kFatal[i], &g_fatal_before[i], nullptr);
    for (std::size_t i = 0; i < kStop.size(); ++i) ::sigaction(kStop[i], &g_stop_before[i], nullptr);
    g_will = {};
}

StopSignalsBlocked::StopSignalsBlocked() {
    sigset_t stop;
    sigemptyset(&stop);
    for (const int signal : kStop) sigaddset(&stop, signal);
    ::pthread_sigmask(SIG_BLOCK, &stop, &before_);
}

StopSignalsBlocked::~StopSignalsBlocked() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

}  // namespace qduino::board::linux
