// qduino metal: a sketch as an image that boots by itself, without an operating system; a run of it
// in an emulated computer, or on a core that Linux gives up for as long as it runs.
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/text.h"
#include "beside/beside_run.h"
#include "board/linux/kernel/memory_folder.h"
#include "posix/small_file.h"
#include "qduino/built_sketch.h"
#include "qduino/command.h"
#include "qduino/metal/boot_medium.h"
#include "qduino/metal/emulators.h"
#include "qduino/trace/pin_record.h"
#include "report/pin/pin_witness.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// The pins of a run beside Linux, where no other program plays what is wired to them.
class CountedPins final : public board::NoPeripherals {
  public:
    void pin_written(Instant, board::PinId pin, board::Level level) override {
        tally_.note(pin.number, level == board::Level::high);
    }
    [[nodiscard]] std::string table() const { return tally_.table(); }

  private:
    PinTally tally_;
};

/// Empty: `words` are two ports, "8080:80".
std::string port_pair_error(const std::string& words) {
    const auto is_port = [](const std::string& digits) {
        return !digits.empty() && digits.size() <= 5 &&
               digits.find_first_not_of("0123456789") == std::string::npos && std::stoi(digits) >= 1 &&
               std::stoi(digits) <= 65535;
    };
    const std::size_t colon = words.find(':');
    const bool good =
        colon != std::string::npos && is_port(words.substr(0, colon)) && is_port(words.substr(colon + 1));
    return good ? "" : "'" + words + "' is not a pair of ports from 1 to 65535, such as 8080:80";
}

Result<void> make_medium(BootWay way, const fs::path& image, const std::string& words,
                         const fs::path& scratch, const fs::path& medium) {
    return (way == BootWay::bios ? make_iso : make_efi)(image, words, scratch, medium);
}

int tell_made(const fs::path& file, const std::string& words) {
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    say(verdict(words));
    return 0;
}

/// `path` is a file that is an image (qduino metal build), and no sketch: by its first bytes
/// (System V ABI, "ELF Header").
bool is_image(const fs::path& path) {
    const auto bytes = fs::is_regular_file(path) ? posix::read_small_file(path) : Result<std::string>("");
    return bytes && bytes->starts_with(
                        "\x7f"
                        "ELF");
}

class Metal final : public Command {
    void declare(CLI::App& app) override {
        add_option(app, "action", action_, "build, iso, efi, run or beside", "ACTION")
            ->required()
            ->check(CLI::IsMember({"build", "iso", "efi", "run", "beside"}));
        sketch_.declare(app);
        length_.declare(app, "Seconds of the computer (default: until Ctrl-C)");
        add_option(app, "--cores", cores_, "Cores, 1 to 8 (default 2)", "N")
            ->check(whole_number_within(1, 8));
        app.add_flag("--deterministic", counted_time_, "Time counts instructions: repeatable");
        add_option(app, "--card", card_, "A network card: virtio-net or e1000", "CARD")
            ->check(CLI::IsMember({"virtio-net", "e1000"}));
        add_option(app, "--forward", forwards_, "A TCP port here is one there: 8080:80", "PORT:PORT")
            ->check(CLI::Validator(port_pair_error, "PORT:PORT"));
        add_option(app, "--wire", wire_, "Make a socket that drives pins, a byte a change", "FILE");
        add_option(app, "--window", window_, "Virtual pins that it shares with another program", "FILE");
        add_option(app, "--files", files_, "Files that the computer can read", "FOLDER")
            ->check(CLI::ExistingDirectory);
        add_option(app, "--words", words_, "What the image is told besides: \"name=value …\"", "WORDS");
        add_option(app, "--record", record_, "Keep here a byte for each write to a pin", "FILE");
        declare_beside(app);
        declare_ways(app);
    }

    void declare_beside(CLI::App& app) {
        add_option(app, "--core", core_, "beside: the core that Linux gives up (default 1)", "N")
            ->check(whole_number_within(1, 7));
        add_option(app, "--silence", silence_ms_,
                   "beside: when Linux is silent so long, safe levels (default 5; 0: it runs on)", "MS")
            ->check(number_within(0.0, 10000.0));
        add_option(app, "--link", link_, "beside: make a printer's link for printd here", "FILE");
    }

    /// Which emulator, and the way from its firmware to the image.
    void declare_ways(CLI::App& app) {
        add_option(app, "--arch", architecture_, "build, run: x86-64 (default) or aarch64", "NAME")
            ->check(CLI::IsMember({"x86-64", "aarch64"}));
        add_option(app, "--boot", boot_, "pvh (default), bios or uefi", "WAY")
            ->check(CLI::IsMember({"pvh", "bios", "uefi"}));
        add_option(app, "--witness", witness_, "qemu (default) or bochs", "NAME")
            ->check(CLI::IsMember({"qemu", "bochs"}));
        add_option(app, "--vcd", vcd_, "Bochs: keep the pins' changes here, with their times", "FILE");
        add_option(app, "--mips", mips_, "Bochs: instructions in a microsecond (default 20)", "N")
            ->check(CLI::IsMember({1, 2, 4, 5, 8, 10, 20, 25, 40, 50, 100, 200, 250, 500}));
        add_option(app, "-o,--output", output_, "iso, efi: the file to make (default: in the cache)", "FILE");
    }

    Result<int> run() override {
        if (action_ == "beside" && is_image(sketch_.sketch))  // nothing is to be built
            return run_beside_linux(sketch_.sketch, fs::path(sketch_.sketch).filename());
        QDUINO_TRY(is_for_aarch64() ? check_aarch64() : check_options());
        QDUINO_TRY_ASSIGN(const auto scratch,
                          board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
        if (const fs::path given = sketch_.sketch; action_ == "run" && is_image(given))
            return run_named(given, given.filename(), scratch.file(""));
        QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(sketch_.sketch));
        QDUINO_TRY_ASSIGN(Sdk tools, tools_of_image());
        QDUINO_TRY_ASSIGN(const SketchBuild build,
                          SketchBuild::open(std::move(tools), sketch, environment_of_this_process()));
        QDUINO_TRY_ASSIGN(const int made, build.make({BoardKind::metal}, sketch_.verbose));
        const fs::path image = build.program(BoardKind::metal);
        if (action_ == "build")
            return tell_made(image, sketch.name + (made == 0          ? " is up to date."
                                                   : is_for_aarch64() ? " is built: QEMU's virt boots it."
                                                                      : " is built: it boots by PVH."));
        if (action_ == "beside") return run_beside_linux(image, sketch.name);
        if (action_ != "run") {
            QDUINO_TRY_ASSIGN(const fs::path medium, keep_medium(image, scratch.file("")));
            return tell_made(medium, sketch.name + (action_ == "iso" ? " boots from a CD, by a BIOS."
                                                                     : " boots by UEFI."));
        }
        return run_named(image, sketch.name, scratch.file(""));
    }

    [[nodiscard]] bool is_for_aarch64() const { return architecture_ == "aarch64"; }

    /// Options that the emulator has not.
    Result<void> check_options() const {
        const bool bochs = witness_ == "bochs";
        if (bochs &&
            (counted_time_ || !wire_.empty() || !card_.empty() || !files_.empty() || !window_.empty()))
            return make_error(
                ErrorCode::invalid_argument,
                "--deterministic, --wire, --card, --files and --window are QEMU's: in Bochs time "
                "always counts instructions, nothing drives its pins, and its card is an e1000");
        if (action_ == "run" && !bochs && !vcd_.empty())
            return make_error(ErrorCode::invalid_argument,
                              "--vcd needs '--witness bochs': QEMU has no clock at its pins");
        return {};
    }

    /// What images for aarch64 have not.
    Result<void> check_aarch64() const {
        if (action_ != "build" && action_ != "run")
            return make_error(ErrorCode::unsupported, "--arch aarch64: there is 'build' and 'run', no '",
                              action_, "'");
        for (const std::string* option : {&boot_, &witness_, &vcd_, &wire_, &card_, &files_, &window_}) {
            if (!option->empty())
                return make_error(
                    ErrorCode::unsupported,
                    "--arch aarch64 has no --boot, --witness, --vcd, --wire, --card, --files and "
                    "--window: QEMU's machine virt boots the image, and traces its eight pins");
        }
        if (!forwards_.empty())
            return make_error(ErrorCode::unsupported, "--arch aarch64 has no --forward: there is no network");
        return {};
    }

    Result<Sdk> tools_of_image() const {
        QDUINO_TRY_ASSIGN(const Sdk sdk, sdk_of_this_program());
        if (is_for_aarch64()) return for_aarch64_images(sdk);
        if (sdk.metal.libraries.empty())
            return make_error(
                ErrorCode::unavailable,
                "this QduinoMC was built without what an image needs. As root, run 'apt-get install "
                "musl-dev', and build it again; here: ",
                sdk.no_metal);
        return for_images(sdk);
    }

    /// What the image is told on its command line.
    std::string image_words() const {
        auto words = length_.seconds ? text<std::string>("for=", Shortest{*length_.seconds}) : std::string{};
        if (!words.empty() && !words_.empty()) words += ' ';
        return words + words_;
    }

    BootWay way_of() const {
        if (witness_ == "bochs" || boot_ == "bios") return BootWay::bios;
        return boot_ == "uefi" ? BootWay::uefi : BootWay::pvh;
    }

    /// The image on a medium of its own, beside it or where --output says.
    Result<fs::path> keep_medium(const fs::path& image, const fs::path& scratch) const {
        fs::path medium = output_;
        if (medium.empty()) (medium = image) += "." + action_;
        QDUINO_TRY(make_medium(action_ == "iso" ? BootWay::bios : BootWay::uefi, image, image_words(),
                               scratch, medium));
        return medium;
    }

    Result<EmulatedRun> run_image(const fs::path& image, const fs::path& scratch) const {
        const EmulatedMachine machine{
            .architecture = is_for_aarch64() ? Architecture::aarch64 : Architecture::x86_64,
            .cores = cores_.value_or(2),
            .words = image_words(),
            .record = record_,
            .counted_time = counted_time_,
            .wire = wire_,
            .card = card_,
            .forwards = forwards_,
            .files = files_,
            .window = window_,
            .mips = mips_};
        if (is_for_aarch64()) return run_in_virt(machine, image, scratch);
        const BootWay way = way_of();
        fs::path medium = image;
        if (way != BootWay::pvh) {
            medium = scratch / "medium";
            QDUINO_TRY(make_medium(way, image, machine.words, scratch, medium));
        }
        return witness_ == "bochs" ? run_in_bochs(machine, medium, scratch)
                                   : run_in_qemu(machine, way, medium, scratch);
    }

    /// Runs it, and tells what the witness saw. Returns the image's status.
    Result<int> run_seen(const fs::path& image, const fs::path& scratch) const {
        QDUINO_TRY_ASSIGN(const EmulatedRun run, run_image(image, scratch));
        if (!vcd_.empty()) QDUINO_TRY(posix::write_file(vcd_, value_change_dump(run.writes)));
        if (window_.empty()) say(pins_table(run.writes));
        return run.status;
    }

    /// Boots it, and says how it ended.
    Result<int> run_named(const fs::path& image, const std::string& name, const fs::path& scratch) const {
        QDUINO_TRY_ASSIGN(const int status, run_seen(image, scratch));
        say(verdict(status == 0   ? name + " ran to its end."
                    : status == 2 ? name + " is REFUSED: no loop of it ran."
                                  : name + " FAILED."));
        return status;
    }

    /// Runs it on a core that Linux gives up, and tells what was seen at its pins.
    Result<int> run_beside_linux(const fs::path& image, const std::string& name) const {
        QDUINO_TRY_ASSIGN(const std::string bytes, posix::read_small_file(image));
        CountedPins pins;
        PinWitness witness;
        witness.forward_to(pins);
        if (!vcd_.empty()) QDUINO_TRY(witness.keep_dump());
        const beside_linux::BesideOptions options{.core = core_.value_or(1),
                                                  .silence = from_seconds(silence_ms_ / 1000),
                                                  .words = image_words(),
                                                  .link = link_};
        QDUINO_TRY_ASSIGN(
            const int status,
            beside_linux::run_beside({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                                     options, witness));
        say(pins.table());
        say(witness.sentences());
        if (!vcd_.empty()) QDUINO_TRY(witness.write_dump(vcd_));
        say(verdict(status == 0   ? name + " ran to its end, and Linux has its core back."
                    : status == 2 ? name + " is REFUSED: no loop of it ran. Linux has its core back."
                    : status == 3 ? name + " was ENDED, for Linux was silent. It has its core back."
                                  : name + " FAILED. Linux has its core back."));
        return status == 3 ? 1 : status;
    }

    std::string action_;  // "build", "iso", "efi", "run" or "beside"
    SketchOptions sketch_;
    LengthOption length_;
    std::optional<int> cores_;
    std::string words_;  // more of what the image is told
    std::string output_;
    // run:
    std::string architecture_;           // "x86-64" or "aarch64"; empty: "x86-64"
    std::string boot_;                   // "pvh", "bios" or "uefi"; empty: "pvh"
    std::string witness_;                // "qemu" or "bochs"; empty: "qemu"
    std::string vcd_;                    // where the pins' changes go; empty: nowhere
    int mips_ = 20;                      // of the computer in Bochs
    std::string record_;                 // what the witness writes at the pins; empty: kept nowhere
    std::string wire_;                   // a socket through which pins are driven from outside
    bool counted_time_ = false;          // time is a count of instructions
    std::string card_;                   // the computer's network card; empty: it has none
    std::vector<std::string> forwards_;  // "PORT:PORT": then it has a card, too
    std::string files_;                  // a folder whose files it can read; empty: none
    std::string window_;                 // a file of virtual pins that it shares; empty: none
    // beside:
    std::optional<int> core_;
    double silence_ms_ = 5;  // of Linux, before the safe levels are driven; 0: no end
    std::string link_;       // a file for a print service; empty: none
};

const Listed<Metal> metal_listed{
    {Place::metal, "metal", "Boot a sketch without Linux",
     "'build' makes an image in the cache and prints its path: the\n"
     "sketch and the scheduler, no operating system. 'iso' makes a CD of it that a\n"
     "BIOS boots, 'efi' a program that UEFI starts. 'run' boots it in an emulator:\n"
     "Serial is this terminal, reports are beside it, and what was written to the\n"
     "pins is seen from outside. 'beside' runs it on a core of this computer that\n"
     "Linux gives up meanwhile (root; docs/metal.md): SKETCH may be an image there.\n"
     "'run' takes one, too. Ends with 2 when admission refuses the sketch.\n"
     "Example: qduino metal run sketches/pulse_train --for 1"}};

}  // namespace
}  // namespace qduino::apps
