// Makes a sketch into programs, outside of any tree: in the user's cache. Makes only what has
// changed.
//
//   ~/.cache/qduino/blink-1f0c…/       by the sketch's path, the tools and the flags: the simulator
//                                      has one of its own, as its objects count what runs
//     sketch.ino.cpp                   the tabs, joined by tools/ino/ino_to_cpp.py
//     sketch.ino.cpp.o  filter.cpp.o
//     scan/                            what was read to find its libraries (library_discovery.h)
//     libraries/…                      objects of libraries in the sketch's own folder
//     blink-sim                        a port differs by what it is linked with
//
//   ~/.cache/qduino/libraries/Bounce2-7a40…/
//                                      a library's objects, for all sketches that compile it with
//                                      the same flags and the same libraries beside it
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"
#include "qduino/build/tool_commands.h"
#include "qduino/common/build_step.h"
#include "qduino/common/sdk.h"
#include "qduino/common/sketch_folder.h"
#include "qduino/library/library_discovery.h"

namespace qduino::apps {

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

    /// The libraries that the sketch needs, found as make() finds them; nothing is compiled. Error:
    /// as make().
    [[nodiscard]] Result<std::vector<Library>> find_libraries() const;

    /// Writes compile_commands.json (Clang's "JSON Compilation Database Format") into the sketch's
    /// folder, for clangd: how each source is compiled, and each tab, as C++ behind Arduino.h.
    /// After make(). Error: the file cannot be written.
    Result<void> write_compile_commands() const;

  private:
    SketchBuild(Sdk sdk, Sketch sketch) : sdk_(std::move(sdk)), sketch_(std::move(sketch)) {}
    [[nodiscard]] std::filesystem::path object_of(const std::filesystem::path& source) const;
    [[nodiscard]] bool is_shared(const Library& library) const;
    /// Where the objects of a library are that many sketches share, compiled with `further`.
    [[nodiscard]] std::filesystem::path shared_folder(const Library& library,
                                                      const std::vector<std::string>& further) const;
    /// Keeps other builds from these, until what is returned ends.
    [[nodiscard]] Result<std::vector<posix::UniqueFd>> lock_shared(
        const std::vector<Library>& libraries) const;
    [[nodiscard]] std::vector<BuildStep> compiling_library(const Library& library,
                                                           const std::vector<std::string>& further) const;
    [[nodiscard]] BuildStep joining() const;
    [[nodiscard]] Result<std::vector<Library>> libraries() const;
    [[nodiscard]] BuildStep compiling(const std::filesystem::path& source,
                                      const std::filesystem::path& object, const std::string& title,
                                      const std::vector<std::string>& further) const;
    [[nodiscard]] std::vector<BuildStep> compiling_all(const std::vector<Library>& libraries) const;
    [[nodiscard]] Result<BuildStep> linking(BoardKind board, const std::vector<BuildStep>& compiled,
                                            const std::vector<Library>& libraries) const;
    [[nodiscard]] Result<posix::UniqueFd> lock() const;
    [[nodiscard]] Result<int> make_locked(const std::vector<BoardKind>& boards, bool verbose) const;

    Sdk sdk_;
    Sketch sketch_;
    std::string home_, qduino_libraries_;
    std::filesystem::path root_;  // of the cache
    std::filesystem::path folder_;
    std::filesystem::path generated_;
    ToolCommands tools_;
};

}  // namespace qduino::apps
