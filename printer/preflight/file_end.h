// Does a file end where its slicer has ended it? A transfer that broke leaves the first part of a
// file, which prints without an error: to the cut.
//
//   what the slicer writes last        PrusaSlicer, SuperSlicer   ; prusaslicer_config = end
//                                      OrcaSlicer, Bambu Studio   ; EXECUTABLE_BLOCK_END
//                                      Cura                       ;End of Gcode
//   how far it says that it is         M73 P100, and ;LAYER_COUNT:
//   how the last line ends             a move without a line feed may be a part of one
//
// (Facts: output of PrusaSlicer 2.5 to 2.9, OrcaSlicer 2, Cura 4 and 5; docs/sources.md.)
// Pure; no heap.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace qduino::printer::preflight {

class FileEnd {
  public:
    void on_bytes(std::span<const char> bytes) {
        if (!bytes.empty()) ends_a_line_ = bytes.back() == '\n' || bytes.back() == '\r';
    }
    void on_comment(std::string_view comment);
    /// A line that holds a command; `moves`: it is one that goes somewhere.
    void on_command(bool moves) { last_moves_ = moves; }
    /// M73 P.
    void on_percent(double percent) {
        ++percents_;
        percent_ = percent;
    }
    /// Why the file seems to be cut off; empty: it does not.
    [[nodiscard]] std::string_view why_cut() const;

  private:
    bool ends_a_line_ = true;
    bool last_moves_ = false;
    bool begun_ = false;  // something that the slicer ends with a comment of its own
    bool ended_ = false;
    std::uint64_t percents_ = 0;
    double percent_ = 0;
    std::optional<std::int64_t> layers_, layer_;  // as Cura counts them
};

}  // namespace qduino::printer::preflight
