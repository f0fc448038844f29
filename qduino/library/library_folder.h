// An Arduino library on disk: which files belong to it, and what it says of itself.
//
//   Bounce/                      of 1.0: the headers lie in the folder
//     Bounce.h  Bounce.cpp
//     utility/…                  compiled too, and searched for headers
//
//   Servo2/                      of 1.5: library.properties, and src/ at any depth
//     library.properties
//     src/Servo2.h  src/avr/x.cpp  src/x.S
//     examples/  extras/         belong to nobody's program
//
// Source: Arduino library specification 2.2 (arduino.github.io/arduino-cli, "Library
// specification").
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

/// The keys and values of a library.properties: "key=value" lines; "#" begins a comment. Nothing in
/// it is an error.
[[nodiscard]] std::map<std::string, std::string> library_properties(std::string_view text);

/// `text` with a blank for each byte that a terminal would obey: the control characters of ASCII
/// and of Unicode (C1). A stranger wrote it.
[[nodiscard]] std::string without_controls(std::string_view text);

/// A flag of a library for the linker that can do no more than link: -lNAME, -LFOLDER, -pthread.
/// Others start programs (a plugin, -B), or read and write files (-o, @FILE).
[[nodiscard]] bool is_harmless_flag(std::string_view flag);

struct Library {
    std::string name;  ///< as its library.properties says; without one, the folder's
    std::filesystem::path folder;
    std::filesystem::path code;  ///< the folder itself, or its src/: what `#include` searches
    bool recursive = false;      ///< src/: every source below it is compiled
    std::string version, sentence;
    std::vector<std::string> architectures;  ///< empty: any
    std::vector<std::string> includes;       ///< headers to include; empty: those in `code`
    std::vector<std::string> depends;        ///< names of libraries, for an installation
    std::vector<std::string> ldflags;
    bool compiled_elsewhere = false;  ///< precompiled=full: it has no sources

    /// Where the compiler looks for its headers.
    [[nodiscard]] std::vector<std::filesystem::path> include_folders() const;
    [[nodiscard]] std::vector<std::filesystem::path> sources() const;
    /// The headers that a sketch is to include.
    [[nodiscard]] std::vector<std::string> headers() const;
    /// Says that it runs on `architecture`: names it, or "*", or none at all.
    [[nodiscard]] bool runs_on(std::string_view architecture) const;
};

/// The library in `folder`. None: it has neither a library.properties nor a header of its own.
[[nodiscard]] std::optional<Library> read_library(const std::filesystem::path& folder);

/// The libraries in the folders within `place`, by folder name; none where there is no such folder.
[[nodiscard]] std::vector<Library> libraries_in(const std::filesystem::path& place);

}  // namespace qduino::apps
