#include "apps/printd/options.h"

#include <CLI/CLI.hpp>

#include "apps/command_line/command_line.h"
#include "base/whole_number.h"

namespace qduino::printd {

namespace {

/// "127.0.0.1:8080", "[::1]:8080", "8080".
bool parse_listen(std::string_view text, Options& options) {
    const std::size_t colon = text.rfind(':');
    if (colon != std::string_view::npos) options.address = text.substr(0, colon);
    if (options.address.size() > 2 && options.address.front() == '[' && options.address.back() == ']') {
        options.address = options.address.substr(1, options.address.size() - 2);
    }
    const std::string_view port = colon == std::string_view::npos ? text : text.substr(colon + 1);
    const auto number = whole_number<decltype(options.port)>(port);
    options.port = number.value_or(options.port);
    return number && !options.address.empty();
}

}  // namespace

std::optional<Options> parse_options(int argc, char** argv, int& exit_status) {
    Options options;
    std::string listen = "127.0.0.1:8080";
    std::string after_failure = "hold";
    CLI::App app{"The print service: takes jobs over HTTP, keeps their queue, feeds the machine"};
    app.footer(
        "Example:\n  printd --state ~/.local/state/qduinomc --link /dev/shm/qduinomc/link \\\n"
        "         --ui web/ui/dist\n\n"
        "  printd --recover --state ~/.local/state/qduinomc\n\n"
        "The key that requests must carry is made at the first start, in DIR/api-key.\n"
        "Exit status: 0 stopped or recovered, 1 could not start, 2 wrong command line,\n3 already running.");
    app.add_option("--state", options.state, "folder of jobs, queue and key")->required();
    app.add_option("--link", options.link, "shared object of the sketch (it may appear later)");
    app.add_option("--listen", listen, "ADDRESS:PORT to serve; port 0 takes any free one")
        ->capture_default_str();
    app.add_option("--ui", options.ui, "folder of the page's files");
    app.add_option("--inspect", options.inspect, "socket of a virtual machine's inspector");
    app.add_option("--vcpu", options.vcpu,
                   "file that says how this service is held to a budget, for the page");
    app.add_option("--serial-port", options.serial_port,
                   "also speak Marlin's serial protocol: socket that printer-port connects to");
    app.add_flag("--serial-wire", options.serial_wire,
                 "its port is a device: nobody can tell whether a host is at the other end");
    app.add_option("--machine", options.machine, "machine file (TOML); the reference machine without");
    app.add_option("--run-as", options.run_as, "user to become, when started by root");
    app.add_option("--allow-host", options.hosts,
                   "a name under which browsers may come, besides addresses and localhost");
    app.add_option("--upload-limit-mib", options.upload_max_mib, "largest file accepted")
        ->capture_default_str()
        ->check(CLI::Range(1, 65536));
    app.add_option("--after-failure", after_failure, "what the queue does when a job has failed")
        ->check(CLI::IsMember({"hold", "continue"}))
        ->capture_default_str();
    app.add_flag("!--no-confirm-bed", options.confirm_bed,
                 "start the next copy without asking whether the bed is clear (for an ejector)");
    app.add_option("--keep-jobs", options.keep_jobs, "ended jobs kept, with their files; 0: all")
        ->capture_default_str()
        ->check(CLI::Range(0, 100'000'000));
    app.add_option("--keep-days", options.keep_days, "days that an ended job is kept; 0: for ever")
        ->capture_default_str()
        ->check(CLI::Range(0, 100'000));
    app.add_option("--store-limit-mib", options.store_max_mib,
                   "what all stored files may take; the oldest ended jobs go first; 0: no limit")
        ->capture_default_str()
        ->check(CLI::Range(0, 1 << 30));
    app.add_flag("--recover", options.recover,
                 "serve nothing: make held jobs of stored files that the job journal has lost; printd must "
                 "not be running");
    app.add_flag("!--no-auth", options.authentication, "ask nobody for the key; only on a loopback address");
    app.add_flag("--print-link", options.print_link, "print the address with the key, for a browser");
    app.add_flag("--verbose", options.verbose, "log more");
    apps::fit_help(app, argv[0]);
    try {
        app.parse(argc, argv);
        if (options.link.empty() && !options.recover) throw CLI::RequiredError{"--link"};
        if (!parse_listen(listen, options)) throw CLI::ValidationError{"--listen", "give ADDRESS:PORT"};
    } catch (const CLI::ParseError& error) {
        exit_status = apps::explain_command_line(app, error) == 0 ? 0 : 2;
        return std::nullopt;
    }
    options.hold_after_failure = after_failure == "hold";
    return options;
}

}  // namespace qduino::printd
