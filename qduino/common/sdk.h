// What a sketch is compiled and linked with. This project's build writes it (sdk.cmake), `qduino`
// reads it.
//
//   build/<preset>/qduino-sdk.json ──► Sdk: compiler, flags, headers, a list of libraries per board
//
// Paths in it may be relative to the file, so that a tree can be moved.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

enum class BoardKind { sim, linux, metal };

/// "sim", "linux", "metal".
[[nodiscard]] const char* name_of(BoardKind board);

struct Sdk {
    std::filesystem::path file;  ///< where it was read from
    /// The C++ compiler: a program, perhaps with a launcher before it.
    std::vector<std::string> cxx;
    std::vector<std::string> cc;
    bool prepares_headers = false;       ///< cxx makes files such as Arduino.h.gch: it is g++
    std::vector<std::string> flags;      ///< of compiling and of linking
    std::vector<std::string> compiling;  ///< of compiling alone
    std::vector<std::string> include;
    std::vector<std::string> definitions;
    std::string python;
    std::filesystem::path ino_to_cpp;
    std::filesystem::path unpack_zip;
    std::filesystem::path as_arduino;  ///< stands before the compilers
    std::filesystem::path supervisor;
    struct Linking {
        std::vector<std::string> libraries;  ///< paths, or "-lname"
        std::vector<std::string> options;
    };
    Linking sim;
    Linking linux;
    std::vector<std::string> sim_compiling;  ///< in the place of `compiling`
    Linking metal;                           ///< no libraries: images cannot be built here …
    std::string no_metal;                    ///< … and why
    std::vector<std::string> metal_flags;    ///< in the place of `flags`
    std::filesystem::path metal_script;      ///< the linker's: where the parts of an image lie
    std::filesystem::path metal_aarch64;     ///< a file that tells the same of images for aarch64

    [[nodiscard]] const Linking& linking(BoardKind board) const {
        return board == BoardKind::sim ? sim : board == BoardKind::linux ? linux : metal;
    }
};

/// The same with the flags of the simulator's objects: the blocks that run are counted there
/// (board/sim/block_count.h), and nowhere else.
[[nodiscard]] Sdk for_simulator(Sdk sdk);
/// The same with the flags and the linker script of images.
[[nodiscard]] Sdk for_images(Sdk sdk);
/// The same for aarch64. Error: what those are linked with has not been built; how.
[[nodiscard]] Result<Sdk> for_aarch64_images(Sdk sdk);

/// The places to look for it.
struct SdkPlaces {
    /// $QDUINO_HOME: a build folder, a source tree with build/release in it, or the file.
    std::string home;
    std::filesystem::path program;   ///< this program: bin/ of a build folder
    std::filesystem::path built_in;  ///< where this program's own build wrote it
};

/// The first that exists. A $QDUINO_HOME without one is an error. Error: not_found, with what to
/// do.
Result<std::filesystem::path> find_sdk(const SdkPlaces& places);

/// Reads the file. Error: corrupt, naming the file.
Result<Sdk> read_sdk(const std::filesystem::path& file);

/// Words separated by blanks: "ccache g++" is two.
[[nodiscard]] std::vector<std::string> words_of(std::string_view text);

}  // namespace qduino::apps
