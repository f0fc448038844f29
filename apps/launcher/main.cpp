// printer-launcher: the printer's processes as one program. ./run starts it.
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <thread>

#include "apps/launcher/first_screen.h"
#include "apps/launcher/launcher.h"
#include "base/whole_number.h"
#include "board/linux/kernel/host_settings.h"
#include "terminal/command_line.h"
#include "terminal/program.h"
#include "web/http/forwarded.h"
#include "web/net/certificate.h"

namespace {

using namespace qduino;

/// The first label of its host name; "printer" where that is no name for a network.
std::string name_of_this_computer() {
    std::array<char, 256> name{};
    const bool found = ::gethostname(name.data(), name.size() - 1) == 0;
    std::string label{found ? name.data() : ""};
    label.resize(std::min(label.size(), label.find('.')));
    return web::is_host_name(label) && label != "localhost" ? label : "printer";
}

/// As root, with a core to spare, unless `refused`. Without its own core, p99 of the lateness was
/// 90 µs on the development machine, and a tenth of all steps was late.
bool isolates(bool refused, double speed) {
    return !refused && speed == 0 && ::geteuid() == 0 && std::thread::hardware_concurrency() >= 2;
}

constexpr apps::Fail fail{"run: "};

int print_report(const std::filesystem::path& state) {
    const auto report = launcher::kept_report(state);
    if (!report) return fail(report.error());
    std::fputs(report->c_str(), stdout);
    return 0;
}

/// What the words say, 1 to 100 ms, nothing for "max"; or what is wrong with them.
std::string read_service_budget(const std::string& words, std::optional<Nanoseconds>& budget) {
    const auto milliseconds = whole_number<int>(words);
    if (words == "max") {
        budget = std::nullopt;
    } else if (milliseconds && *milliseconds >= 1 && *milliseconds <= launcher::kServicePeriod / 1ms) {
        budget = *milliseconds * 1ms;
    } else {
        return "give 1 to 100 (ms in each 100 ms) or max, not '" + words + "'";
    }
    return {};
}

}  // namespace

int main(int argc, char** argv) {
    launcher::Options options;
    options.settings_state = board::linux::kDefaultSettingsState;
    bool no_isolate = false;
    apps::CommandLine line{"Starts the printer's processes, keeps them running, and stops them together.",
                           "Example: printer-launcher --state ~/.local/state/qduinomc --ui web/ui/dist"};
    line.typed_as("./run");
    line.option("--state", options.state, "folder of jobs, queue and key").required();
    line.option("--ui", options.ui, "folder of the page's files");
    bool lan = false;
    line.flag("--lan", lan, "others on the network may reach the service, by TLS and with the key");
    line.option("--listen", options.listen,
                "the address that the service listens on (default 127.0.0.1; with --lan all)")
        .called("ADDRESS")
        .check([](const std::string& address) {
            return web::is_numeric_address(address) ? ""
                                                    : "give an address as numbers, not '" + address + "'";
        });
    line.option("--port", options.port, "the service's port").within(1, 65535).shows_default();
    line.option("--serial-port", options.serial_port,
                "also take a serial host's lines: pty, or DEVICE[@BAUD]");
    line.option("--speed", options.speed, "in the simulator, so many times as fast").within(0.01, 10000.0);
    line.option("--machine", options.machine, "machine file (TOML)").existing_file();
    line.flag("--no-isolate", no_isolate, "as root: leave this computer's cores as they are");
    apps::declare_service_options(line, options.service);
    std::string service_budget;
    line.option("--service-budget", service_budget,
                "the print service's CPU time in each 100 ms of core 0; max: no budget (default: 10, or "
                "what surely fits)")
        .called("MS")
        .check([&options](const std::string& words) {
            options.service_budget_exactly = true;
            return read_service_budget(words, options.service_budget);
        });
    line.option("--run-as", options.service_user, "user that the service becomes, as root");
    bool report = false;
    line.flag("--report", report, "start nothing: print what holds of the printer with this state folder");
    if (const auto status = line.parse(argc, argv)) return *status;
    if (report) return print_report(options.state);
    if (options.ui.empty()) return fail("give the folder of the page's files with --ui");
    if (const std::string wrong = apps::problem_of(options.service); !wrong.empty())
        return line.refuse(wrong);
    if (options.listen.empty()) options.listen = lan ? "::" : "127.0.0.1";
    if (lan && options.service.name.empty()) options.service.name = name_of_this_computer();
    options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
    options.isolate = isolates(no_isolate, options.speed);

    const int signals = apps::block_and_watch({SIGINT, SIGTERM, SIGHUP});
    auto launcher = launcher::Launcher::open(std::move(options));
    if (!launcher) return fail(launcher.error());
    return (*launcher)->run(signals);
}
