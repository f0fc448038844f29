#include <signal.h>

#include "apps/supervisor/supervisor.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace qduino::supervisor {
int run_command_line(int argc, char** argv, SystemCalls& system) {
    Options options;
    options.real_time = true;
    apps::CommandLine line{
        "Runs a sketch, outlives it, and forces its safe states within 100 ms of its death or of a loop that "
        "hangs.\n"
        "Example: qduino-supervisor --pins /dev/shm/qduino-pins -- printer --pins /dev/shm/qduino-pins"};
    long timeout_ms = 1000;
    line.option("--pins", options.pins, "file of the virtual pins, made by the machine").required();
    line.option("--link", options.link, "file of the link to the print service, to mark as dead");
    line.option("--timeout-ms", timeout_ms,
                "a loop is hung when not heard of for so long (at least); 0: do not watch")
        .shows_default()
        .within(0, 3'600'000L);
    line.option("--settings-state", options.settings_state,
                "where the sketch records its changes to the machine")
        .shows_default();
    line.option("--sysfs-root", options.sysfs_root, "what precedes /sys, for tests");
    line.option("--starter", options.starter,
                "word of who started this: when that dies, the sketch ends at once");
    line.flag("--restart", options.restart, "start the sketch again when it died or hung");
    line.flag("--make-pins", options.make_pins, "real pins only: there is no virtual machine, make the file");
    line.option("command", options.command, "the sketch and its arguments, after --").required();
    if (const auto status = line.parse(argc, argv)) return *status;
    options.heartbeat_timeout = std::chrono::milliseconds{timeout_ms};

    auto supervisor = Supervisor::open(std::move(options), system);
    if (!supervisor) return apps::Fail{"qduino-supervisor: "}(supervisor.error());
    return supervisor->run(apps::block_and_watch({SIGTERM, SIGINT}));
}

}  // namespace qduino::supervisor
