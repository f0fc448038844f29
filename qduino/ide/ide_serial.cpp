#include "qduino/ide/ide_serial.h"

#include <fcntl.h>
#include <signal.h>

#include <filesystem>
#include <utility>

#include "posix/unique_fd.h"
#include "qduino/common/child_process.h"
#include "qduino/ide/ide_discovery.h"
#include "qduino/upload/board_folder.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// The processes behind the ports. They end with this.
class PortProcesses {
  public:
    PortProcesses() : nothing_(::open("/dev/null", O_RDWR | O_CLOEXEC)) {}
    ~PortProcesses() {
        for (const pid_t port : running_) ::kill(port, SIGTERM);
        for (const pid_t port : running_) wait_for(port);
    }
    PortProcesses(const PortProcesses&) = delete;
    PortProcesses& operator=(const PortProcesses&) = delete;

    /// `host` as for open_way(). stdout is the IDE's: none of them gets it.
    Result<void> make(const fs::path& program, const fs::path& link, const std::string& host) {
        Words command{program, "monitor", "--tty", link};
        if (!host.empty()) command.insert(command.end(), {"--to", host});
        QDUINO_TRY_ASSIGN(const pid_t port,
                          start(command, {.input = nothing_.get(), .output = nothing_.get()}));
        running_.push_back(port);
        return {};
    }

  private:
    posix::UniqueFd nothing_;
    std::vector<pid_t> running_;
};

/// A discovery that a signal ends as well: the IDE kills its tools when it is closed.
class SerialDiscovery final : public IdeDiscovery {
  public:
    explicit SerialDiscovery(std::vector<IdePort> ports)
        : IdeDiscovery(std::move(ports), Greeting::none),
          signals_(block_and_watch({SIGINT, SIGTERM, SIGHUP})) {}

    [[nodiscard]] std::vector<pollfd> waits() const override { return {{signals_.get(), POLLIN, 0}}; }
    [[nodiscard]] std::string serve(std::span<const pollfd> seen) override {
        if (seen[0].revents != 0) quit();
        return {};
    }

  private:
    posix::UniqueFd signals_;
};

}  // namespace

Result<int> ide_serial(const Words& hosts) {
    QDUINO_TRY_ASSIGN(const BoardFolder folder, BoardFolder::open());
    std::error_code failed;
    const fs::path program = fs::read_symlink("/proc/self/exe", failed);
    std::vector<IdePort> ports = ports_of(hosts);
    // The signals are blocked before there is a process that has to be ended.
    for (IdePort& port : ports) {
        port.address = folder.serial_port(port.board);
        port.protocol = "serial";
    }
    SerialDiscovery discovery(ports);
    PortProcesses processes;
    for (std::size_t i = 0; i < ports.size(); ++i)
        QDUINO_TRY(processes.make(program, ports[i].address, i == 0 ? std::string{} : hosts[i - 1]));
    return run_ide_tool(discovery);
}

}  // namespace qduino::apps
