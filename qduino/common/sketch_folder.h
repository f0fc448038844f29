// A sketch on disk: which files belong to it.
//
//   blink/            the folder is the sketch, and gives it its name
//     blink.ino       tabs: every .ino (and .pde); the one named as the folder first
//     motor.ino
//     filter.cpp      compiled beside the tabs, as are .c and .S files
//     src/…           and what is in here, at any depth
//     libraries/…     libraries of this sketch's own (library_shelf.h)
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

struct Sketch {
    std::string name;
    std::filesystem::path folder;                ///< absolute
    std::vector<std::filesystem::path> tabs;     ///< in the order in which they are joined
    std::vector<std::filesystem::path> sources;  ///< .cpp, .c and .S, sorted
};

/// Finds the sketch for `argument`, a folder or an .ino. An .ino with its folder's name, or the
/// only one there, means the whole folder; any other stands for itself alone. Error: not_found,
/// invalid_argument.
Result<Sketch> find_sketch(const std::filesystem::path& argument);

/// `qduino new`: makes the folder `path`, and in it an .ino of the same name with two loops, and
/// the tasks of Visual Studio Code.
/// Returns the .ino. Error: already_exists (nothing is overwritten), invalid_argument (no sketch
/// can have this name), or the folder cannot be made.
Result<std::filesystem::path> make_sketch(const std::filesystem::path& path);

}  // namespace qduino::apps
