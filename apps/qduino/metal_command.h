// `qduino metal`: a sketch as an image that boots by itself, without an operating system, and a run
// of it in an emulated machine.
#pragma once

#include "apps/qduino/arguments.h"
#include "apps/qduino/sdk.h"
#include "base/result.h"

namespace qduino::apps {

/// Carries out `arguments.action`: "build", "iso", "efi" or "run". Returns the exit status; 2 when
/// admission refuses the sketch. Error: no image or medium can be made here, or there is no
/// emulator: what to do.
[[nodiscard]] Result<int> metal(const Arguments& arguments, const Sdk& sdk);

}  // namespace qduino::apps
