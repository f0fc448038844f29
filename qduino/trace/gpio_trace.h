// A witness at the pins of an emulated PL061: QEMU traces each output that changes, in a line of
// text.
//
//   QEMU ─► "… setting output 6 to 1" ─► a named pipe ─► thread ─► PinWrite
#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"
#include "qduino/trace/pin_record.h"

namespace qduino::apps {

/// What one line of the trace tells; empty: it is none of an output.
[[nodiscard]] std::optional<PinWrite> traced_write(std::string_view line);

class GpioTrace {
  public:
    /// Makes the pipe at `path`, and reads what comes until end(). Error: it cannot be made.
    [[nodiscard]] Result<void> begin(const std::filesystem::path& path);
    /// When the emulator has ended: the changes, in order. All pins begin low.
    [[nodiscard]] std::vector<PinWrite> end();

  private:
    void read_lines(const std::stop_token& end);
    void take(std::string_view text);

    posix::UniqueFd pipe_;
    std::string rest_;  // of a line that has not come whole
    std::vector<PinWrite> writes_;
    std::vector<bool> levels_ = std::vector<bool>(128);
    std::jthread reader_;  // last: it ends first
};

}  // namespace qduino::apps
