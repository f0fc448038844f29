// Lines that one command stands for: a macro of the machine file, or M116's waits. They are carried
// out one by one, as if they stood in the file in place of the command.
//
//   [macros]                                  PRINT_START BED=60 EXTRUDER=205
//   PRINT_START = """                         │
//   G28                                       ├─► G28
//   M190 S{BED}                               ├─► M190 S60
//   M109 S{EXTRUDER=200}                      └─► M109 S205
//   """
//
// `{NAME}` becomes the value that the call gives; `{NAME=200}` has a value for a call without one.
// There is nothing else: no conditions, no arithmetic, and a macro calls no macro, so every macro
// ends. Bounded; no heap.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "base/fixed_string.h"
#include "base/result.h"
#include "printer/machine_config.h"

namespace qduino::printer::gcode {

/// The macro of that name, in upper case, in the machine file; null: none.
const Macro* find_macro(const MachineConfig& config, std::string_view word);

class Expansion {
  public:
    static constexpr std::size_t kBytesMax = 1536;

    /// The lines of `text`, its parameters filled in from `arguments` (`KEY=VALUE …`). Error: a
    /// parameter without a value, a brace without its other half, or too much text; nothing is
    /// active then.
    [[nodiscard]] Result<void> begin(std::string_view name, std::string_view text,
                                     std::string_view arguments);
    [[nodiscard]] bool active() const { return at_ < lines_.size(); }
    /// The next line. Contract: active().
    [[nodiscard]] std::string_view next();
    void clear() {
        lines_.clear();
        at_ = 0;
    }
    /// Whose lines they are.
    [[nodiscard]] std::string_view name() const { return name_.view(); }

  private:
    [[nodiscard]] Result<void> append(std::string_view piece);

    FixedString<32> name_;
    FixedString<kBytesMax> lines_;
    std::size_t at_ = 0;
};

}  // namespace qduino::printer::gcode
