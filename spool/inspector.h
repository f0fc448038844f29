// Compares the printed part with what was asked (on a virtual machine: the twin). Optional.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace qduino::spool {

/// Calls return at once; the spool asks again on the next tick. From the spool's thread only.
class Inspector {
  public:
    virtual ~Inspector() = default;
    /// Announces `run`, whose file is at the path `gcode`. Repeated until begun().
    virtual void begin(std::uint64_t run, const std::string& gcode) = 0;
    /// True once the inspector looks, or is known not to answer: the first byte may cross.
    [[nodiscard]] virtual bool begun(std::uint64_t run) = 0;
    /// Number `number`, from 0, of the lines that a person typed of the run's objects or of its
    /// flow, when the machine had read its file up to line `behind_line`, and had still to lay down
    /// `left_mm` of that line's filament.
    virtual void typed(std::uint64_t run, std::uint32_t number, std::uint64_t behind_line, double left_mm,
                       const std::string& line) = 0;
    /// The run has ended. The machine reports that the head left the path and came back this many
    /// times (pauses).
    virtual void end(std::uint64_t run, std::uint32_t excursions) = 0;
    /// The report as a JSON object; an empty string when there will be none; nothing while it is
    /// awaited.
    [[nodiscard]] virtual std::optional<std::string> report(std::uint64_t run) = 0;
};

}  // namespace qduino::spool
