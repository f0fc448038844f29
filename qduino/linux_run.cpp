#include "qduino/linux_run.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "base/text.h"
#include "qduino/common/child_process.h"
#include "report/picture/strip.h"
#include "terminal/colour.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

bool names_real_devices(const board::linux::LinuxConfig& board) {
    return !board.gpio.empty() || !board.pwm.empty() || !board.analog.empty() || !board.i2c.empty() ||
           !board.spi.empty();
}

/// An ordinary process may be kept from running for longer than the supervisor waits for a
/// real-time one, and is not hung for that.
constexpr const char* kPatienceMs = "10000";

}  // namespace

Result<Words> linux_command(const LinuxProgram& what, board::linux::MemoryFolder& folder, Behind behind) {
    std::string pins = what.pins.empty() ? what.board.pins_path : what.pins;
    Words sketch{what.program.string()};
    append(sketch, what.words);
    if (!fs::exists(what.supervisor)) {
        say("no qduino-supervisor: safe states hold only as long as the sketch lives", "qduino: ");
        if (!pins.empty()) append(sketch, {"--pins", pins});
        return sketch;
    }
    // Memory that several processes map must never wait for a disk. It goes when the run is over.
    Words command{what.supervisor.string(), "--settings-state", what.board.settings_state};
    if (what.best_effort || !what.board.real_time) append(command, {"--timeout-ms", kPatienceMs});
    if (pins.empty()) {
        QDUINO_TRY_ASSIGN(folder, board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        std::fputs(names_real_devices(what.board)
                       ? "Pins that the board file does not name are connected to nothing.\n"
                       : "No pins are named: all are connected to nothing (--board names real ones,\n"
                         "--pins those of a virtual machine).\n"
                         "What the sketch drives is told at the end.\n",
                   stderr);
        pins = folder.file("pins");
        if (behind == Behind::nobody) command.emplace_back("--make-pins");
    }
    append(command, {"--pins", pins, "--"});
    append(command, sketch);
    append(command, {"--pins", pins});
    return command;
}

PinsAsked::PinsAsked(const PictureOptions& picture, const ShownOptions& shown)
    : vcd(shown.vcd), from(from_seconds(picture.from_s.value_or(0))), plain(shown.plain) {
    if (picture.length_s) length = std::max(from_seconds(*picture.length_s), Nanoseconds{1});
}

Result<LinuxRun> run_on_linux(const LinuxProgram& what, const PinsAsked* asked) {
    const bool loose = what.pins.empty() && what.board.pins_path.empty() && fs::exists(what.supervisor);
    const bool seen = asked && loose;
    if (asked && !loose && !asked->vcd.empty())
        return make_error(ErrorCode::invalid_argument,
                          "--vcd is about pins that are connected to nothing: those of --pins belong to the "
                          "program behind them, and without a supervisor there are none");
    board::linux::MemoryFolder folder;
    QDUINO_TRY_ASSIGN(const Words command, linux_command(what, folder, seen ? Behind::us : Behind::nobody));
    LinuxRun run;
    if (seen) {
        QDUINO_TRY_ASSIGN(run.pins, LoosePins::serve(folder.file("pins"), !asked->vcd.empty(), asked->from));
    }
    QDUINO_TRY_ASSIGN(run.status, run_in_front(command));
    if (run.pins) run.pins->end();
    return run;
}

picture::Schedule pins_of(PinWitness& pins, const std::string& sketch, const PinsAsked& asked) {
    picture::Schedule schedule;
    schedule.title = sketch + " on this computer: its pins";
    schedule.remark =
        "What the sketch drove, from its first write on. Nothing is connected to these pins. When which loop "
        "ran: 'qduino trace --linux --picture FILE', as root.";
    schedule.from = kEpoch + asked.from;
    schedule.until = schedule.from + asked.length.value_or(100ms);
    pins.add_rows(schedule, pins.origin(), !asked.length);
    return schedule;
}

Result<void> show_pins(LoosePins& pins, const PinsAsked& asked, const picture::Schedule& schedule) {
    std::string words;
    const bool colours = wants_colour(STDERR_FILENO);
    if (!asked.plain && schedule.cores.empty())
        words = picture::strip(schedule, picture::signs_of_terminal(), colours);
    if (!words.empty()) words += '\n';
    words += pins.witness().empty() ? "No pin was driven.\n" : pins.witness().sentences();
    if (const auto faults = pins.faults(); faults.lost + faults.disordered > 0)
        write(words, faults.lost, " changes of pins were lost, ", faults.disordered,
              " came too late: this computer was too busy to listen\n");
    if (!asked.vcd.empty()) {
        QDUINO_TRY(pins.witness().write_dump(asked.vcd));
        write(words, "pins: ", asked.vcd, "\n  (open it in GTKWave or PulseView)\n");
    }
    say("\n" + words);
    return {};
}

}  // namespace qduino::apps
