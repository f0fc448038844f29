// A sketch as it travels to another computer: its sources, and those of its libraries, which are
// then its own. Sources, because the other computer may have another processor.
//
//   blink/                  what lies beside the sketch too: headers, data; nothing hidden
//     blink.ino
//     libraries/Foo/        without its examples
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "qduino/common/sketch_folder.h"
#include "qduino/library/library_folder.h"

namespace qduino::apps {

/// Makes the parcel in `folder`, which exists. Error: a file cannot be copied.
[[nodiscard]] Result<void> pack_sketch(const Sketch& sketch, const std::vector<Library>& libraries,
                                       const std::filesystem::path& folder);

/// Unpacks the tar on standard input into `folder`, in the place of what it had, and returns the
/// sketch's folder in it. Error: it is no parcel.
[[nodiscard]] Result<std::filesystem::path> unpack_sketch(const std::filesystem::path& folder);

}  // namespace qduino::apps
