// What a witness outside of a computer has seen at the port of its pins (board/metal/pins.h): one
// byte for each write, the level in its highest bit and the pin's number in the others.
//
//   QEMU    the bytes alone, in a file           ─┐
//   Bochs   its log: a line with the time of each ─┴─► writes ─► a table, or VCD
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "board/types.h"

namespace qduino::apps {

struct PinWrite {
    std::int64_t ns = 0;  ///< of the computer's time; 0 where the witness has no clock
    std::uint8_t pin = 0;
    bool high = false;

    friend bool operator==(const PinWrite&, const PinWrite&) = default;
};

/// The writes as bytes, without their times, and back.
[[nodiscard]] std::string bytes_of(std::span<const PinWrite> writes);
[[nodiscard]] std::vector<PinWrite> writes_of(std::string_view bytes);

/// What an emulator's log says of a run.
struct BochsLog {
    std::vector<PinWrite> writes;
    std::optional<int> status;  ///< with which the image turned the computer off
};
/// `log`: with a line for each write to a port that no device has, as Bochs writes it, with its
/// tick in front. Other lines are skipped.
[[nodiscard]] BochsLog read_bochs_log(std::string_view log, std::int64_t ns_per_tick);

/// How often each pin was written and rose, and its level at the end.
class PinTally {
  public:
    void note(std::size_t pin, bool high);
    [[nodiscard]] std::string table() const;

  private:
    struct Seen {
        long long writes = 0;
        long long rises = 0;
        bool high = false;
    };
    std::array<Seen, board::kPinCount> pins_{};
};
/// The same of all these.
[[nodiscard]] std::string pins_table(std::span<const PinWrite> writes);

/// The changes as a value change dump (report/pin/value_change_dump.h).
[[nodiscard]] std::string value_change_dump(std::span<const PinWrite> writes);

}  // namespace qduino::apps
