// A file of virtual pins of this process, and a machine at the other end of it.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "board/linux/pin/pins_server.h"
#include "board/peripherals.h"

namespace qduino::bench {

class Pins {
  public:
    /// In /dev/shm. `machine` sees the edges, and outlives this.
    explicit Pins(board::Peripherals& machine);
    ~Pins();
    Pins(const Pins&) = delete;
    Pins& operator=(const Pins&) = delete;

    [[nodiscard]] bool ready() const { return server_.has_value(); }
    [[nodiscard]] const std::string& path() const { return path_; }
    /// Shows the machine all that was written until now.
    void poll();
    /// Edges that found their ring full.
    [[nodiscard]] std::uint64_t lost() const { return server_->faults().lost; }

  private:
    board::Peripherals& machine_;
    std::string path_;
    std::optional<board::linux::PinsServer> server_;
};

}  // namespace qduino::bench
