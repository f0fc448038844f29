// printer-launcher: the printer's processes as one program. ./run starts it.
#include <signal.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <thread>

#include "apps/command_line/command_line.h"
#include "apps/launcher/launcher.h"
#include "apps/terminal/program.h"
#include "base/whole_number.h"
#include "board/linux/host_settings.h"

namespace {

using namespace qduino;

/// As root, with a core to spare, unless `refused`. Without its own core, p99 of the lateness was
/// 90 µs on the development machine, and a tenth of all steps was late.
bool isolates(bool refused, double speed) {
    return !refused && speed == 0 && ::geteuid() == 0 && std::thread::hardware_concurrency() >= 2;
}

/// 1 to 100 ms; nothing for "max".
std::optional<Nanoseconds> service_budget(const std::string& words) {
    if (words == "max") return std::nullopt;
    const auto milliseconds = whole_number<int>(words);
    if (!milliseconds || *milliseconds < 1 || *milliseconds > launcher::kServicePeriod / 1ms)
        throw CLI::ValidationError("--service-budget",
                                   "give 1 to 100 (ms in each 100 ms) or max, not '" + words + "'");
    return *milliseconds * 1ms;
}

}  // namespace

int main(int argc, char** argv) {
    launcher::Options options;
    options.settings_state = board::linux::kDefaultSettingsState;
    bool no_isolate = false;
    CLI::App app{"Starts the printer's processes, keeps them running, and stops them together."};
    app.footer("Example: printer-launcher --state ~/.local/state/qduinomc --ui web/ui/dist");
    app.add_option("--state", options.state, "folder of jobs, queue and key")->required();
    app.add_option("--ui", options.ui, "folder of the page's files")->required();
    app.add_option("--port", options.port, "the service's port on 127.0.0.1")
        ->check(CLI::Range(1, 65535))
        ->capture_default_str();
    app.add_option("--serial-port", options.serial_port,
                   "also take a serial host's lines: pty, or DEVICE[@BAUD]");
    app.add_option("--speed", options.speed, "in the simulator, so many times as fast")
        ->check(CLI::Range(0.01, 10000.0));
    app.add_option("--machine", options.machine, "machine file (TOML)")->check(CLI::ExistingFile);
    app.add_flag("--no-isolate", no_isolate, "as root: leave this machine's cores as they are");
    app.add_flag("!--no-confirm-bed", options.confirm_bed,
                 "do not wait for \"Bed is clear\" after a job (an ejector does)");
    app.add_option_function<std::string>(
           "--service-budget",
           [&options](const std::string& budget) { options.service_budget = service_budget(budget); },
           "the print service's CPU time in each 100 ms of core 0; max: no budget (default 10)")
        ->option_text("MS");
    app.add_option("--run-as", options.service_user, "user that the service becomes, as root");
    if (const auto status = apps::parse_command_line(app, argc, argv)) return *status;
    options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    options.isolate = isolates(no_isolate, options.speed);

    const int signals = apps::block_and_watch({SIGINT, SIGTERM, SIGHUP});
    auto launcher = launcher::Launcher::open(std::move(options));
    if (!launcher) return apps::Fail{"run: "}(launcher.error());
    return (*launcher)->run(signals);
}
