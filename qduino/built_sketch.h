// A sketch, made into the programs of some boards: the first half of most commands.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "base/result.h"
#include "qduino/build/sketch_build.h"
#include "qduino/common/sdk.h"
#include "qduino/options.h"

namespace qduino::apps {

/// With what this program compiles sketches: what stands beside it, or where it was built. Error:
/// there is none.
[[nodiscard]] Result<Sdk> sdk_of_this_program();

struct BuiltSketch {
    Sdk sdk;
    Sketch sketch;
    std::vector<std::filesystem::path> programs;  ///< in the order of the boards
    int steps = 0;                                ///< that had to be made
};

/// Makes what is missing. Error: there is no such sketch, or it does not compile; the compiler has
/// said why.
[[nodiscard]] Result<BuiltSketch> build_sketch(const SketchOptions& options,
                                               const std::vector<BoardKind>& boards);

/// Builds the simulator's program and becomes it, with the words that `words` makes for the sketch.
/// Returns the exit status when it did not come so far: 1 for a board file that is wrong, which is
/// said. Error: as build_sketch(); the picture's name.
[[nodiscard]] Result<int> become_simulation(const SketchOptions& options, const BoardOption& board,
                                            const PictureOptions& picture,
                                            const std::function<Words(const Sketch&)>& words);

/// How a run of the sketch `name` has ended, in a sentence. The sketch's own report has already
/// said how its loops kept their periods.
[[nodiscard]] std::string end_of(const std::string& name, int status);

}  // namespace qduino::apps
