// The recipes of the Arduino IDE's builder: what platform.txt (ide_platform.h) makes it call.
//
//   preprocess ─► the builder finds libraries and functions   (a sketch's own text, as it is)
//   compile    ─► X.o, X.d   the tabs are joined by ino_to_cpp.py, not by the builder's ctags, and
//                            the options are those of `qduino build`
//   link       ─► NAME-linux, and NAME-sim for the check alone: the same objects on the simulator
//   check      ─► the verdict of admission, into the IDE's pane
//   size       ─► of NAME-linux
//
// So the builder decides what is compiled and when; how it is compiled is decided here, and a
// program has the same options from both.
//
//   BUILD/sketch/    the builder's text of the tabs: it only says when to compile
//   BUILD/joined/    ours, from the tabs in the sketch's folder
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "qduino/common/sdk.h"
#include "qduino/common/words.h"

namespace qduino::apps {

/// Carries out `recipe`, one of those above, on the words that platform.txt hands it. Returns
/// the exit status; the compilers' words go to stderr. Error: words are missing, a tool cannot be
/// started, a file cannot be written.
[[nodiscard]] Result<int> run_recipe(const Sdk& sdk, const std::string& recipe, const Words& words);

/// True for the name of a recipe.
[[nodiscard]] bool is_recipe(const std::string& name);

/// The program that `link` makes of a project, BUILD/NAME, where NAME is the main tab's. `qduino
/// build` gives it the same name, by which a sketch's EEPROM goes.
[[nodiscard]] std::filesystem::path built_by_ide(const std::filesystem::path& project, BoardKind board);

/// What the builder says of a project, BUILD/NAME: its sketch, and the folders of libraries.
struct IdeProject {
    std::filesystem::path sketch;
    std::string libraries;  ///< with ':' between them
};
/// Error: corrupt, the builder has written nothing, or not this.
[[nodiscard]] Result<IdeProject> read_ide_project(const std::filesystem::path& project);

/// The rule that make(1) reads, with one file a line, as the builder wants it: the object first,
/// then its source, then what else went into it.
[[nodiscard]] std::string depfile_of(const std::string& object, const std::string& source,
                                     const Words& others);

}  // namespace qduino::apps
