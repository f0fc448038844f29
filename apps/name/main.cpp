// printer-name: the printer's name on the network. A process of its own, without rights: it reads
// what anybody on the network sends.
#include <csignal>
#include <cstdio>

#include "apps/name/announcer.h"
#include "rights/privileges.h"
#include "terminal/command_line.h"
#include "terminal/program.h"

int main(int argc, char** argv) {
    using namespace qduino;
    std::string name, user, state;
    std::uint16_t port = 8080;
    apps::CommandLine line{"Tells the network, by multicast DNS, that NAME.local is this computer.",
                           "Prints NAME.local once the name is ours. Exit status: 0 stopped,\n1 the name is "
                           "another computer's, or there is no multicast DNS here."};
    line.option("--name", name, "the name, without .local").required();
    line.option("--port", port, "where the printer is served").shows_default();
    line.option("--state", state, "folder of jobs, queue and key").required();
    line.option("--run-as", user, "user to become, when started by root");
    if (const auto status = line.parse(argc, argv)) return *status;
    const apps::Fail fail{"printer-name: "};
    if (!user.empty()) {
        if (const Result<void> became = rights::become(user, state); !became) return fail(became.error());
    }
    const int signals = apps::block_and_watch({SIGINT, SIGTERM});
    int status = 0;
    name::Announcer* running = nullptr;
    name::Announcer announcer{name, port, [&](name::Event event) {
                                  if (event == name::Event::announced) {
                                      std::printf("%s.local\n", name.c_str());
                                      std::fflush(stdout);
                                      return;
                                  }
                                  status = 1;
                                  if (running) running->stop();
                              }};
    running = &announcer;
    if (const Result<void> started = announcer.start(); !started) return fail(started.error());
    if (status == 0) announcer.run(signals);
    if (status == 0) return 0;
    return fail(make_error(ErrorCode::already_exists, "another computer on this network is called ", name,
                           ".local: give the printer another name with --lan NAME. Until then its address "
                           "alone leads to it"));
}
