// printer-port: the port that a serial host opens. It finds M112 in the bytes by itself, and passes
// all of them on to the print service.
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>

#include "apps/port/port_relay.h"
#include "rights/privileges.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

namespace {

using namespace qduino;

constexpr apps::Fail fail{"printer-port: "};
constexpr std::string_view kPty = "pty";

struct Options {
    std::string port;
    std::filesystem::path state;
    std::string service;
    std::filesystem::path link;
    std::string user;
};

/// Rights that outlast root: a real-time priority no higher than a loop's, and locked memory.
void keep_rights() {
    constexpr rlim_t kHighestLoop = 80;
    const rlimit priority{kHighestLoop, kHighestLoop};
    static_cast<void>(::setrlimit(RLIMIT_RTPRIO, &priority));
    const rlimit all{RLIM_INFINITY, RLIM_INFINITY};
    static_cast<void>(::setrlimit(RLIMIT_MEMLOCK, &all));
}

Result<void> run(const Options& options) {
    ::umask(077);
    std::signal(SIGPIPE, SIG_IGN);
    std::optional<apps::SerialPort> port;
    if (options.port != kPty) {  // only root may open most of them
        QDUINO_TRY_ASSIGN(port, apps::SerialPort::open_device(options.port));
    }
    if (::geteuid() == 0) keep_rights();
    if (!options.user.empty()) QDUINO_TRY(rights::become(options.user, options.state));
    if (!port) {
        QDUINO_TRY_ASSIGN(port, apps::SerialPort::make_pty(options.state / "serial"));
    }
    port::PortRelay relay{std::move(*port), options.service, options.link};
    std::printf("%s\n", relay.port().name().c_str());
    std::fflush(stdout);
    while (true) relay.turn();
}

}  // namespace

int main(int argc, char** argv) {
    Options options;
    apps::CommandLine line{
        "Carries a serial host's bytes to the print service, and stops the printer at an M112 in them.",
        "Example: printer-port --port pty --state STATE --service /dev/shm/qduino/port --link …/link"};
    line.option("--port", options.port, "pty: a terminal, linked from STATE/serial; or DEVICE[@BAUD]")
        .required();
    line.option("--state", options.state, "folder of jobs, queue and key").required();
    line.option("--service", options.service, "socket of the print service").required();
    line.option("--link", options.link, "file of the sketch's link").required();
    line.option("--run-as", options.user, "user to become, when started by root");
    if (const auto status = line.parse(argc, argv)) return *status;
    const Result<void> ended = run(options);
    return ended ? 0 : fail(ended.error());
}
