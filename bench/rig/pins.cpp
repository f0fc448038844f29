#include "bench/rig/pins.h"

#include <unistd.h>

#include <filesystem>

#include "board/linux/kernel/clock.h"

namespace qduino::bench {

Pins::Pins(board::Peripherals& machine)
    : machine_(machine), path_("/dev/shm/qduino-bench-" + std::to_string(::getpid()) + ".pins") {
    auto created = board::linux::PinsServer::create(path_);
    if (created) server_.emplace(std::move(created.value()));
}

Pins::~Pins() { std::filesystem::remove(path_); }

void Pins::poll() {
    while (server_->poll(board::linux::monotonic_now(), machine_) > 0) {
    }
}

}  // namespace qduino::bench
