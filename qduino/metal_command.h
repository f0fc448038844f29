// `qduino metal`: a sketch as an image that boots by itself, without an operating system, and a run
// of it in an emulated machine.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "qduino/arguments.h"
#include "qduino/common/sdk.h"

namespace qduino::apps {

/// Carries out `arguments.action`: "build", "iso", "efi", "run" or "beside". Returns the exit
/// status; 2 when admission refuses the sketch. Error: no image or medium can be made here, or
/// there is no emulator: what to do.
[[nodiscard]] Result<int> metal(const Arguments& arguments, const Sdk& sdk);

/// `path` is a file that is an image (qduino metal build), and no sketch: by its first bytes
/// (System V ABI, "ELF Header").
[[nodiscard]] bool is_image(const std::filesystem::path& path);

/// What the image is told on its command line.
[[nodiscard]] std::string image_words(const Arguments& arguments);

}  // namespace qduino::apps
