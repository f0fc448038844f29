// The commands that compile and link a sketch, up to its files: one place for their options,
// whoever builds. `qduino build` makes its steps of them, and the Arduino IDE's recipes run them
// (ide_recipe.h), so a sketch is the same program from both.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "qduino/build/prepared_headers.h"
#include "qduino/common/sdk.h"
#include "qduino/common/sketch_folder.h"
#include "qduino/common/words.h"
#include "qduino/library/library_discovery.h"

namespace qduino::apps {

/// The environment: $XDG_CACHE_HOME, $HOME, $QDUINO_LIBRARIES, $CXX, $CC, $CXXFLAGS, $CFLAGS,
/// $LDFLAGS, $QDUINO_LONG. Empty: not set.
struct BuildEnvironment {
    std::string xdg_cache_home, home, qduino_libraries;
    std::string cxx, cc, cxxflags, cflags, ldflags;
    std::string long_bits;  ///< "64": `long` is the compiler's own; else it has 32 bits
};
[[nodiscard]] BuildEnvironment environment_of_this_process();

/// The folder for what is built and fetched. Error: not_found, when neither names one.
[[nodiscard]] Result<std::filesystem::path> cache_root(const BuildEnvironment& environment);

struct ToolCommands {
    CompileCommands compile;
    std::string own_headers;  ///< the word of `compile` that names the sketch's folder
    Words link;
    /// To be made before C++ is compiled; none: the compiler does not know such, or has flags of
    /// the user's.
    std::optional<PreparedHeaders> headers;
};

/// Those of a sketch whose headers lie in `folder`.
[[nodiscard]] ToolCommands tool_commands(const Sdk& sdk, const std::filesystem::path& folder,
                                         const BuildEnvironment& environment);

/// Joins the tabs of `sketch` into one source.
[[nodiscard]] Words join_command(const Sdk& sdk, const Sketch& sketch, const std::filesystem::path& output);

/// Links `objects` with a board's libraries into `output`. Error: not_found, one of these is
/// missing.
[[nodiscard]] Result<Words> link_command(const ToolCommands& tools, const Sdk::Linking& with,
                                         const Words& objects, const Words& ldflags,
                                         const std::filesystem::path& output);

}  // namespace qduino::apps
