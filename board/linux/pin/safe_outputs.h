// Forces every kind of output to its declared safe level. The supervisor and its heat watch use it:
// they outlive the sketch.
//
//   behind the pin                          how it is made safe
//   ─────────────────────────────────────────────────────────────────────────────────────────────
//   virtual pin                             edges of the forcer's own ring: PWM off, then the level
//   PWM channel (/sys/class/pwm)            duty_cycle 0, or the whole period for high;
//                                           if that is refused, enable 0
//   GPIO line (/dev/gpiochipN)              the line is requested anew, as an output of that level,
//                                           and held
//
// All it needs stands in the shared file (OutputPin): the sketch writes it there before it can
// drive the pin. A line can be taken only once the dead process has let go of it. So the caller
// repeats force() until `lines_missing` is 0. Forcing an output more than once does no harm.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "board/linux/pin/pin_writer.h"
#include "board/linux/pin/pins_file.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

struct ForcedOutputs {
    int pins = 0;             ///< with a safe state, of every kind
    int lines_missing = 0;    ///< GPIO lines that somebody else still holds, or that cannot be had
    int channels_failed = 0;  ///< PWM channels that took neither the duty nor the end
};

class SafeOutputs {
  public:
    SafeOutputs() = default;  ///< of no file: only for assignment

    /// Takes writer `writer` of `file`, which must outlive this. `sysfs_root` precedes /sys
    /// (tests). Setup-time.
    Result<void> open(const PinsFile& file, int writer, std::string sysfs_root);

    /// The next sketch needs the lines that were taken over.
    void release_lines();
    /// Forces all outputs with a safe state. Never waits.
    ForcedOutputs force();

  private:
    [[nodiscard]] bool force_channel(const OutputPin& output, Level level) const;
    [[nodiscard]] bool force_line(std::size_t pin, const OutputPin& output, Level level);

    PinsLayout* layout_ = nullptr;
    PinWriter writer_;
    std::string sysfs_root_;
    std::vector<posix::UniqueFd> lines_;  // by pin
};

}  // namespace qduino::board::linux
