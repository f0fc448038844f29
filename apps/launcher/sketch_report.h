// What the sketch has to say at its start (`printer --report FILE`): a line on its cores, a line on
// its guarantees, an empty line, and the guarantee report.
//
// The file has no name in any folder, where another user could put something else: the launcher
// makes it in memory, and the sketch inherits it through its supervisor.
#pragma once

#include <string>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

struct SketchWords {
    std::string where;       ///< "core 1 is the stepper's"
    std::string guarantees;  ///< "steps yes, heat yes"
    std::string rest;
};

/// Reads it; what is missing is empty. Control characters are left out.
[[nodiscard]] SketchWords read_sketch_words(std::string_view text);

class SketchReport {
  public:
    SketchReport() = default;  ///< none
    /// Error: the system's.
    [[nodiscard]] static Result<SketchReport> make();

    /// For the sketch's command line; valid in processes that inherited it.
    [[nodiscard]] std::string path() const;
    /// In the child that becomes the supervisor: it and its children inherit the file.
    void hand_on() const;
    [[nodiscard]] SketchWords read() const;
    /// Before a sketch is started: what an earlier one said is no longer true.
    void clear() const;

  private:
    posix::UniqueFd file_;
};

}  // namespace qduino::launcher
