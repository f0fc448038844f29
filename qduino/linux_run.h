// A sketch's program in real time on this computer, under the supervisor where there is one; and
// what its pins did, where they are connected to nothing.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "board/linux/kernel/linux_config.h"
#include "board/linux/kernel/memory_folder.h"
#include "qduino/build/loose_pins.h"
#include "qduino/built_sketch.h"
#include "qduino/common/words.h"
#include "report/picture/schedule.h"
#include "report/pin/pin_witness.h"

namespace qduino::apps {

/// What is run, and how.
struct LinuxProgram {
    std::filesystem::path program, supervisor;
    board::linux::LinuxConfig board;
    std::string pins;          ///< virtual ones; empty: those of the board file, or our own
    bool best_effort = false;  ///< as an ordinary process
    Words words;               ///< for the sketch's program
};

/// The program behind pins that are connected to nothing.
enum class Behind { nobody, us };

/// The command that runs it. The pins are in `folder`, made here, when no others are named;
/// `behind` them we serve them before it starts, or nobody.
[[nodiscard]] Result<Words> linux_command(const LinuxProgram& what, board::linux::MemoryFolder& folder,
                                          Behind behind);

/// How the pins of a run on Linux are to be shown: here, for the sketch's program does not see
/// them.
struct PinsAsked {
    std::string vcd;  ///< empty: no dump
    Nanoseconds from{0};
    std::optional<Nanoseconds> length;
    bool plain = false;

    PinsAsked(const PictureOptions& picture, const ShownOptions& shown);
};

/// A run on Linux that has ended.
struct LinuxRun {
    int status = 0;
    std::unique_ptr<LoosePins> pins;  ///< null: they belong to another program, or nobody asked
};

/// Runs it to its end. With `asked` the pins that are connected to nothing are seen.
[[nodiscard]] Result<LinuxRun> run_on_linux(const LinuxProgram& what, const PinsAsked* asked);

/// The run's pins alone, as a picture: nobody has seen when which loop ran.
[[nodiscard]] picture::Schedule pins_of(PinWitness& pins, const std::string& sketch, const PinsAsked& asked);

/// Says what the pins did, and writes the dump that is asked for.
[[nodiscard]] Result<void> show_pins(LoosePins& pins, const PinsAsked& asked,
                                     const picture::Schedule& schedule);

}  // namespace qduino::apps
