// qduino-supervisor: runs a sketch, outlives it, and forces its safe states when it dies or hangs.
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/signalfd.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "apps/supervisor/supervisor.h"

namespace {

/// Above every loop, so that a sketch that hangs at real-time priority cannot keep the supervisor from its
/// work. Asked for, not demanded: an ordinary user gets none of it. The child starts as an ordinary process.
void be_important() {
    sched_param parameters{};
    parameters.sched_priority = 90;
    ::sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters);
    ::mlockall(MCL_CURRENT | MCL_FUTURE);
}

int stop_signals() {
    sigset_t stop;
    sigemptyset(&stop);
    sigaddset(&stop, SIGTERM);
    sigaddset(&stop, SIGINT);
    ::sigprocmask(SIG_BLOCK, &stop, nullptr);
    return ::signalfd(-1, &stop, SFD_CLOEXEC);
}

}  // namespace

int main(int argc, char** argv) {
    qduino::supervisor::Options options;
    CLI::App app{
        "Runs a sketch, outlives it, and forces its safe states within 100 ms of its death or of a loop that "
        "hangs.\n"
        "Example: qduino-supervisor --pins /dev/shm/qduino-pins -- printer --pins /dev/shm/qduino-pins"};
    long timeout_ms = 1000;
    app.add_option("--pins", options.pins, "file of the virtual pins, made by the machine")->required();
    app.add_option("--link", options.link, "file of the link to the print service, to mark as dead");
    app.add_option("--timeout-ms", timeout_ms,
                   "a loop is hung when not heard of for so long (at least); 0: do not watch")
        ->capture_default_str()
        ->check(CLI::Range(0L, 3'600'000L));
    app.add_option("--settings-state", options.settings_state,
                   "where the sketch records its changes to the machine")
        ->capture_default_str();
    app.add_flag("--restart", options.restart, "start the sketch again when it died or hung");
    app.add_flag("--make-pins", options.make_pins,
                 "real pins only: there is no virtual machine, make the file");
    app.add_option("command", options.command, "the sketch and its arguments, after --")->required();
    CLI11_PARSE(app, argc, argv);
    options.heartbeat_timeout = std::chrono::milliseconds{timeout_ms};

    auto supervisor = qduino::supervisor::Supervisor::open(std::move(options));
    if (!supervisor) {
        std::fprintf(stderr, "qduino-supervisor: %s\n",
                     std::string{supervisor.error().message.view()}.c_str());
        return 1;
    }
    be_important();
    return supervisor->run(stop_signals());
}
