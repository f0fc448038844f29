// Options that several commands have. Each group declares itself, and gives its words to the
// sketch's own program, which takes the same.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "config/board_file.h"
#include "qduino/common/words.h"
#include "terminal/parser.h"

namespace qduino::apps {

/// Which sketch, and how much is said of building it.
struct SketchOptions {
    std::string sketch = ".";  ///< folder or .ino
    bool verbose = false;

    void declare(CLI::App& app);
};

/// How long it runs.
struct LengthOption {
    std::optional<double> seconds;

    void declare(CLI::App& app, const char* description);
    void add_to(Words& words) const;
};

/// The board file. It is read before anything is compiled.
struct BoardOption {
    std::string file;  ///< empty: the default board

    void declare(CLI::App& app);
    void add_to(Words& words) const;
    [[nodiscard]] ReadBoardFile read() const;
};

/// Virtual pins that exist already.
struct PinsOption {
    std::string file;  ///< empty: none

    void declare(CLI::App& app);
};

/// Where the guarantees are written.
struct ReportOption {
    std::string file;  ///< empty: nowhere

    void declare(CLI::App& app);
    void add_to(Words& words) const;
};

/// The simulated computer.
struct SimulatedOptions {
    BoardOption board;
    std::optional<int> cores;
    std::optional<std::uint64_t> seed;

    void declare(CLI::App& app);
    void add_to(Words& words) const;
};

struct PictureOptions {
    std::string file;  ///< empty: no picture
    std::optional<double> from_s, length_s;

    void declare(CLI::App& app, const char* description);
    void add_to(Words& words) const;
    /// Error: the file's ending is none that is drawn. Without a file nothing is wrong.
    [[nodiscard]] Result<void> check() const;
};

/// What shows the pins beside a picture.
struct ShownOptions {
    std::string vcd;     ///< where the pins' changes go; empty: nowhere
    bool plain = false;  ///< no strips of blocks

    void declare(CLI::App& app);
    void add_to(Words& words) const;
};

/// A run on Linux.
struct RealTimeOptions {
    bool isolate = false, best_effort = false;

    void declare(CLI::App& app);
    void add_to(Words& words) const;
};

/// Another computer, as ssh takes it.
struct ToOption {
    std::string host;  ///< "user@host"; empty: this computer

    void declare(CLI::App& app);
};

/// "--name VALUE".
template <typename Value>
void add_words(Words& words, const char* name, const Value& value) {
    words.insert(words.end(), {name, text<std::string>(value)});
}

}  // namespace qduino::apps
