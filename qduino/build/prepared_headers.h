// Arduino.h, read by the compiler once for all sketches. It includes 65,000 lines of the standard
// library, and most of the time that it took to compile a sketch was to read them again.
//
//   qduino-sdk.json
//   headers/9e37…/Arduino.h.gch     beside it, one for each set of flags; some 80 MB
//                                   (in the user's cache where only root may write there)
//                 Arduino.h         leads to the board's own
//
// g++ takes the .gch in the place of the header when compiler and flags are the same, and reads the
// header when they are not. So it is never wrong to name the folder.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"
#include "qduino/common/sdk.h"

namespace qduino::apps {

class PreparedHeaders {
  public:
    /// @param compiler  the C++ compiler with its flags, before any folder of a sketch
    /// @param cache     where to write when the SDK's folder cannot be written
    PreparedHeaders(const Sdk& sdk, std::vector<std::string> compiler, const std::filesystem::path& cache);

    /// The folder to name to tools/ino/as_arduino.py.
    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

    /// Makes what is missing or older than the headers. While the result lives, no other build
    /// changes it. Where it cannot be written, or the compiler refuses, there is none, which slows
    /// the build down and does nothing else.
    [[nodiscard]] posix::UniqueFd make(bool verbose) const;

  private:
    std::filesystem::path header_;
    std::vector<std::string> compiler_;
    std::filesystem::path folder_;
};

}  // namespace qduino::apps
