// Writes every step as a line of CSV: `printer-sim --steps`. It sits between the board and the twin
// and sees pins alone.
#pragma once

#include <array>
#include <cstdint>
#include <fstream>
#include <string>

#include "board/peripherals.h"
#include "printer/machine_config.h"

namespace qduino::apps {

/// Forwards everything to `next`, and writes `time_ns,axis,direction` for each rising edge of a
/// STEP pin: nanoseconds since the board started, X Y Z or E, +1 or −1 in machine coordinates.
class StepLog final : public board::ForwardingPeripherals {
  public:
    /// Opens and empties `path`. ok() tells whether that worked.
    StepLog(const std::string& path, const printer::MachineConfig& config, board::Peripherals& next);
    /// True when everything so far is in the file.
    [[nodiscard]] bool ok() const { return file_.good(); }
    bool close();
    /// Steps are written from now on.
    void begin() { begun_ = true; }

    void pin_written(Instant now, board::PinId pin, board::Level level) override;

  private:
    enum class Role : std::uint8_t { none, step, direction };
    struct Wire {
        Role role = Role::none;
        std::uint8_t axis = 0;
    };
    void write_line(Instant now, std::size_t axis);

    std::ofstream file_;
    bool begun_ = false;
    std::array<Wire, board::kPinCount> wires_{};
    std::array<bool, printer::kAxisCount> high_{};
    std::array<bool, printer::kAxisCount> positive_{};
    std::array<bool, printer::kAxisCount> inverted_{};
};

}  // namespace qduino::apps
