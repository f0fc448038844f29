#include "apps/printd/options.h"

#include "base/whole_number.h"
#include "terminal/command_line.h"

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
    apps::CommandLine line{
        "The print service: takes jobs over HTTP, keeps their queue, feeds the machine",
        "Example:\n  printd --state ~/.local/state/qduinomc --link /dev/shm/qduinomc/link \\\n"
        "         --ui web/ui/dist\n\n"
        "  printd --recover --state ~/.local/state/qduinomc\n\n"
        "The key that requests must carry is made at the first start, in DIR/api-key.\n"
        "Exit status: 0 stopped or recovered, 1 could not start, 2 wrong command line,\n3 already running."};
    line.option("--state", options.state, "folder of jobs, queue and key").required();
    line.option("--link", options.link, "shared object of the sketch (it may appear later)");
    line.option("--listen", listen, "ADDRESS:PORT to serve, [::] for all; port 0 takes any free one")
        .shows_default();
    line.option("--ui", options.ui, "folder of the page's files");
    line.option("--inspect", options.inspect, "socket of a virtual machine's inspector");
    line.option("--vcpu", options.vcpu, "file that says how this service is held to a budget, for the page");
    line.option("--serial-port", options.serial_port,
                "also speak Marlin's serial protocol: socket that printer-port connects to");
    line.flag("--serial-wire", options.serial_wire,
              "its port is a device: nobody can tell whether a host is at the other end");
    line.option("--machine", options.machine, "machine file (TOML); the reference machine without");
    line.option("--run-as", options.run_as, "user to become, when started by root");
    declare_service_options(line, options);
    line.flag("--recover", options.recover,
              "serve nothing: make held jobs of stored files that the job journal has lost; printd must "
              "not be running");
    line.flag("!--no-auth", options.authentication, "ask nobody for the key; only on a loopback address");
    line.flag("--print-link", options.print_link, "print the address with the key, for a browser");
    line.flag("--verbose", options.verbose, "log more");
    std::optional<int> status = line.parse(argc, argv);
    if (!status && options.link.empty() && !options.recover) status = line.refuse("--link is required");
    if (!status && !parse_listen(listen, options)) status = line.refuse("--listen: give ADDRESS:PORT");
    if (const std::string wrong = problem_of(options); !status && !wrong.empty()) status = line.refuse(wrong);
    if (status) {
        exit_status = *status == 0 ? 0 : 2;
        return std::nullopt;
    }
    return options;
}

}  // namespace qduino::printd
