// The libraries that a sketch can have, and which of them a header means.
//
//   sketchbook/libraries/          beside the sketches, if it is this user's or root's
//   sketchbook/blink/blink.ino
//   sketchbook/blink/libraries/    the sketch's own: before all others
//   $QDUINO_LIBRARIES              folders of libraries, with ':' between them
//   ~/Arduino/libraries/           the user's
//
// Several libraries may have a header of the same name. The rules that choose, in this order, are
// those of the Arduino builder (arduino-cli, "Sketch build process", dependency resolution): the
// sketch's own libraries; one that says it runs here; the name that is most like the header's; one
// that names this architecture; the nearer folder. A header that the board has (SPI.h, Servo.h) is
// never asked for: the board's is found first.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "qduino/common/sketch_folder.h"
#include "qduino/library/library_folder.h"

namespace qduino::apps {

/// The name of this board's architecture in library.properties.
inline constexpr const char* kArchitecture = "qduino";

/// The folder that `qduino lib` writes into: the first of $QDUINO_LIBRARIES, else
/// ~/Arduino/libraries. Error: neither is set.
[[nodiscard]] Result<std::filesystem::path> user_libraries(const std::string& qduino_libraries,
                                                           const std::string& home);

class LibraryShelf {
  public:
    /// All that this sketch can have. `qduino_libraries` is $QDUINO_LIBRARIES.
    LibraryShelf(const Sketch& sketch, const std::string& qduino_libraries, const std::string& home);

    /// Those that have `header`, the one that is meant first. `header` is as `#include` names it;
    /// one that leads out of a library is in none.
    [[nodiscard]] std::vector<Library> having(const std::string& header) const;
    [[nodiscard]] bool empty() const { return places_.empty(); }

  private:
    struct Place {
        bool own = false;
        std::vector<Library> libraries;
    };
    void add(const std::filesystem::path& folder, bool own);
    void add(std::vector<Library> libraries, bool own);

    std::vector<Place> places_;  // nearest first
    std::vector<std::filesystem::path> seen_;
};

/// How like the name of a header (without its extension) a library's is: 7, the library and its
/// folder have it, to 1, one of them contains it; 0.
[[nodiscard]] int likeness(const Library& library, const std::string& header);

}  // namespace qduino::apps
