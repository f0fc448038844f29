// What makes this board one of the Arduino IDE's: a platform in the user's sketchbook, as IDE 1.8
// and arduino-builder read it (Arduino Platform specification 1.x).
//
//   ~/Arduino/hardware/qduino/linux/boards.txt      this computer, and each one that was named
//                                  /platform.txt    recipes, which call this program
//                                                   (ide_recipe.h), and tools (ide_tool.h)
//                                  /cores/qduino/   empty: the board's headers are this program's
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

/// The text of boards.txt: a board for this computer, and one for each of `hosts`
/// ("user@host", as ssh takes them).
[[nodiscard]] std::string boards_text(const std::vector<std::string>& hosts);

/// Names of boards there: this computer's, and a host's.
inline constexpr const char* kBoardHere = "here";
[[nodiscard]] std::string board_id_of(const std::string& host);

/// The text of platform.txt; `program` is the path of qduino.
[[nodiscard]] std::string platform_text(const std::string& program, const std::vector<std::string>& hosts);

/// The sketchbook: `named`, else ~/Arduino. Error: neither.
[[nodiscard]] Result<std::filesystem::path> sketchbook(const std::string& named, const std::string& home);

/// Writes the platform into a sketchbook, in the place of an older one, and returns its folder.
/// Error: a host is no name, a file cannot be written.
Result<std::filesystem::path> install_platform(const std::filesystem::path& sketchbook,
                                               const std::string& program,
                                               const std::vector<std::string>& hosts);

/// Removes what install_platform() wrote. False: there was none.
bool remove_platform(const std::filesystem::path& sketchbook);

}  // namespace qduino::apps
