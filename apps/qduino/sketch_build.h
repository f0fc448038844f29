// Makes a sketch into programs, outside of any tree: in the user's cache. Makes only what has
// changed.
//
//   ~/.cache/qduino/blink-1f0c…/       by the sketch's path, the tools and the flags
//     sketch.ino.cpp                   the tabs, joined by tools/ino/ino_to_cpp.py
//     sketch.ino.cpp.o  filter.cpp.o   the same for both boards
//     blink-sim  blink-linux           a port differs by what it is linked with
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "apps/qduino/sdk.h"
#include "apps/qduino/sketch_folder.h"
#include "base/result.h"

namespace qduino::apps {

/// The environment: $XDG_CACHE_HOME, $HOME, $CXX, $CC, $CXXFLAGS, $CFLAGS, $LDFLAGS. Empty: not
/// set.
struct BuildEnvironment {
    std::string xdg_cache_home, home;
    std::string cxx, cc, cxxflags, cflags, ldflags;
};
[[nodiscard]] BuildEnvironment environment_of_this_process();

class SketchBuild {
  public:
    /// Error: there is no folder for the cache.
    static Result<SketchBuild> open(Sdk sdk, Sketch sketch, const BuildEnvironment& environment);

    /// The path of a board's program, made or to be made.
    [[nodiscard]] std::filesystem::path program(BoardKind board) const;
    [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

    /// Makes the programs of `boards`. The compilers' words go to stderr. Returns how many steps
    /// had to run; 0: all was up to date. Error: the sketch does not compile or link (its messages
    /// have been printed), or a tool is missing. Waits for another build of the same sketch.
    Result<int> make(const std::vector<BoardKind>& boards, bool verbose) const;

  private:
    SketchBuild(Sdk sdk, Sketch sketch) : sdk_(std::move(sdk)), sketch_(std::move(sketch)) {}
    [[nodiscard]] std::filesystem::path object_of(const std::filesystem::path& source) const;
    [[nodiscard]] std::vector<std::filesystem::path> objects() const;
    [[nodiscard]] Result<int> make_locked(const std::vector<BoardKind>& boards, bool verbose) const;

    Sdk sdk_;
    Sketch sketch_;
    std::filesystem::path folder_;
    std::filesystem::path generated_;
    // The commands, up to their arguments.
    std::vector<std::string> compile_cxx_, compile_c_, link_;
};

}  // namespace qduino::apps
