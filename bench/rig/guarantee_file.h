// The guarantee report of a board that runs in a child process: the child writes it, the parent reads it.
#pragma once

#include <string>

#include "bench/rig/report.h"
#include "board/guarantee.h"

namespace qduino::bench {

/// A file in memory, named for the process that made this object; gone with it there, not in its children, which leave by _exit().
class GuaranteeFile {
  public:
    GuaranteeFile();
    ~GuaranteeFile();
    GuaranteeFile(const GuaranteeFile&) = delete;
    GuaranteeFile& operator=(const GuaranteeFile&) = delete;

    [[nodiscard]] const std::string& path() const { return path_; }
    void write(const board::GuaranteeReport& report) const;
    /// What was written; a discarded value when nothing was.
    [[nodiscard]] Json read() const;

  private:
    std::string path_;
};

}  // namespace qduino::bench
