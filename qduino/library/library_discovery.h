// Which libraries a sketch needs: those that have the headers it includes, and the headers that
// these include, and so on.
//
//   a source ── preprocessed ──► "HEADER: No such file" ──► the shelf: Foo ──► Foo's sources
//       ▲                                                                           │
//       └───────────────────────── again, with Foo's folder ◄───────────────────────┘
//
// So a library is found as the Arduino builder finds it: by a header that nobody else has, under
// the conditions (#if) that hold by then. A depfile is left for each source that was preprocessed,
// and `libraries` remembers what was found: a sketch that has not changed is not preprocessed
// again. When a remembered library is not reached any more, all is found anew.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "qduino/common/words.h"
#include "qduino/library/library_shelf.h"

namespace qduino::apps {

/// The words that compile a file, up to its name: for C++, C, assembler.
struct CompileCommands {
    Words cpp, c, assembler;
    [[nodiscard]] const Words& for_source(const std::filesystem::path& source) const;
};

/// The options by which a compiler finds the headers of `libraries`. They are the system's to it: a
/// sketch's author cannot mend their warnings, and the board's own headers come first.
[[nodiscard]] Words include_words(const std::vector<Library>& libraries);

/// The header that a compiler's words (of the C locale) say is missing; empty: none is.
[[nodiscard]] std::string missing_header(std::string_view log);

struct DiscoveredLibraries {
    std::vector<Library> libraries;  ///< in the order in which they were found
    /// What a person should know of those that were not there the last time: several have a header;
    /// one is made for other boards.
    std::vector<std::string> notes;
};

/// Finds the libraries of `sources`; records go into `folder`, of which there is one for each set
/// of commands. A header that no library has is left to the compiler. Error: the compiler cannot be
/// started, a record cannot be written.
[[nodiscard]] Result<DiscoveredLibraries> discover_libraries(
    const LibraryShelf& shelf, const CompileCommands& commands,
    const std::vector<std::filesystem::path>& sources, const std::filesystem::path& folder);

}  // namespace qduino::apps
