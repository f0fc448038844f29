// The Linux board against the contract: virtual pins in shared memory, the wires on a machine's
// thread; without privileges.
#include <sched.h>
#include <unistd.h>

#include <thread>

#include "board/linux/linux_board.h"
#include "board/linux/pin/pins_server.h"
#include "tests/unit/board/board_contract.h"

namespace qduino::board::contract::linux_contract_test {
namespace {

class LinuxBench {
  public:
    LinuxBench() : path_("/dev/shm/qduino-contract-" + std::to_string(::getpid())) {
        auto server = linux::PinsServer::create(path_);
        EXPECT_TRUE(server) << server.error().message.view();
        server_ = std::make_unique<linux::PinsServer>(std::move(server.value()));
        machine_ = std::thread([this] {
            while (!quit_) {
                server_->wait(1ms);
                server_->poll(linux::monotonic_now(), wires_);
            }
        });
        linux::LinuxConfig config;
        config.pins_path = path_;
        config.real_time = false;  // what a test asserts must hold without it
        config.lock_memory = false;
        config.handle_signals = false;
        auto board = linux::LinuxBoard::open(config);
        // Both sides have it open: nothing is left behind, however the test ends.
        ::unlink(path_.c_str());
        EXPECT_TRUE(board) << board.error().message.view();
        board_ = std::move(board.value());
    }
    ~LinuxBench() {
        if (machine_.joinable()) static_cast<void>(finish());
    }

    Board& board() { return *board_; }
    const ContractWires& finish() {
        quit_ = true;
        machine_.join();
        while (server_->poll(linux::monotonic_now(), wires_) > 0) {
        }
        return wires_;
    }
    int current_core() { return ::sched_getcpu(); }

  private:
    std::string path_;
    ContractWires wires_;
    std::unique_ptr<linux::PinsServer> server_;
    std::unique_ptr<linux::LinuxBoard> board_;
    std::atomic<bool> quit_{false};
    std::thread machine_;
};

INSTANTIATE_TYPED_TEST_SUITE_P(Linux, BoardContract, LinuxBench);

}  // namespace
}  // namespace qduino::board::contract::linux_contract_test
