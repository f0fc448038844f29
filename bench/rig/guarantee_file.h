// The guarantee report of a board that runs in a child process: the child writes it, the parent
// reads it.
#pragma once

#include <string>

#include "bench/rig/report.h"
#include "board/guarantee.h"

namespace qduino::bench {

/// A file in memory, named for the process that made this object. That process removes it; its
/// children, which leave by _exit(), do not.
class GuaranteeFile {
  public:
    GuaranteeFile();
    ~GuaranteeFile();
    GuaranteeFile(const GuaranteeFile&) = delete;
    GuaranteeFile& operator=(const GuaranteeFile&) = delete;

    [[nodiscard]] const std::string& path() const { return path_; }
    void write(const board::GuaranteeReport& report) const;
    /// The report; a discarded value when none was written.
    [[nodiscard]] Json read() const;

  private:
    std::string path_;
};

}  // namespace qduino::bench
