// The lines of an asked path: those of the file, and those that its words stand for.
//
//   file ──► PRINT_START BED=60 ──► [macros]  G28 / M190 S{BED} ──► G28, M190 S60
//
// The text of a macro belongs to what is asked: it comes with the twin's machine. `{NAME}` is the
// value of the call, `{NAME=200}` has a value for a call without one. A macro calls none.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "twin/byte_source.h"
#include "twin/line_reader.h"
#include "twin/machine.h"

namespace qduino::twin {

class AskedLines {
  public:
    /// `source` must outlive this.
    AskedLines(ByteSource& source, const std::vector<MacroSpec>& macros) : file_(source), macros_(macros) {}

    /// The next command, or nothing at the end.
    [[nodiscard]] std::optional<CommandLine> next();
    /// `line` was typed while the machine had read the file up to line `behind`: it comes behind
    /// that one, or next when that one has been passed. `left_mm`: filament of that line that was
    /// still to be laid down, as the machine took it to be until then.
    void insert(std::uint64_t behind, std::string_view line, double left_mm) {
        typed_.push_back(LineReader::parse(line));
        typed_.back().typed = {behind, left_mm};
    }
    /// What was typed behind the lines that have been given, one at a time.
    [[nodiscard]] std::optional<CommandLine> take_typed();
    /// Whose the file is, as far as it has been read. A line that was typed says nothing of it.
    [[nodiscard]] Flavour flavour() const { return flavour_; }
    /// The number, from 1, of the line of the file that next() gave last.
    [[nodiscard]] std::uint64_t number() const { return file_.number(); }

  private:
    [[nodiscard]] bool expand(const CommandLine& call);

    void heed(const CommandLine& command);

    LineReader file_;
    Flavour flavour_ = Flavour::marlin;
    std::vector<MacroSpec> macros_;
    std::deque<CommandLine> expanded_;
    std::deque<CommandLine> typed_;
};

}  // namespace qduino::twin
