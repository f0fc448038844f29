#include "qduino/metal_command.h"

#include <cstdio>
#include <filesystem>

#include "base/text.h"
#include "board/linux/kernel/memory_folder.h"
#include "posix/small_file.h"
#include "qduino/beside_command.h"
#include "qduino/build/sketch_build.h"
#include "qduino/metal/boot_medium.h"
#include "qduino/metal/emulators.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// Options that the emulator has not.
Result<void> check_options(const Arguments& arguments) {
    const bool bochs = arguments.witness == "bochs";
    if (bochs && (arguments.counted_time || !arguments.wire.empty() || !arguments.card.empty() ||
                  !arguments.files.empty() || !arguments.window.empty()))
        return make_error(ErrorCode::invalid_argument,
                          "--deterministic, --wire, --card, --files and --window are QEMU's: in Bochs time "
                          "always counts instructions, nothing drives its pins, and its card is an e1000");
    if (arguments.action == "run" && !bochs && !arguments.vcd.empty())
        return make_error(ErrorCode::invalid_argument,
                          "--vcd needs '--witness bochs': QEMU has no clock at its pins");
    return {};
}

bool is_for_aarch64(const Arguments& arguments) { return arguments.architecture == "aarch64"; }

/// What images for aarch64 have not.
Result<void> check_aarch64(const Arguments& arguments) {
    if (arguments.action != "build" && arguments.action != "run")
        return make_error(ErrorCode::unsupported, "--arch aarch64: there is 'build' and 'run', no '",
                          arguments.action, "'");
    for (const std::string* option : {&arguments.boot, &arguments.witness, &arguments.vcd, &arguments.wire,
                                      &arguments.card, &arguments.files, &arguments.window}) {
        if (!option->empty())
            return make_error(ErrorCode::unsupported,
                              "--arch aarch64 has no --boot, --witness, --vcd, --wire, --card, --files and "
                              "--window: QEMU's machine virt boots the image, and traces its eight pins");
    }
    if (!arguments.forwards.empty())
        return make_error(ErrorCode::unsupported, "--arch aarch64 has no --forward: there is no network");
    return {};
}

BootWay way_of(const Arguments& arguments) {
    if (arguments.witness == "bochs" || arguments.boot == "bios") return BootWay::bios;
    return arguments.boot == "uefi" ? BootWay::uefi : BootWay::pvh;
}

Result<void> make_medium(BootWay way, const fs::path& image, const std::string& words,
                         const fs::path& scratch, const fs::path& medium) {
    return (way == BootWay::bios ? make_iso : make_efi)(image, words, scratch, medium);
}

/// The image on a medium of its own, beside it or where --output says.
Result<fs::path> keep_medium(const Arguments& arguments, const fs::path& image, const fs::path& scratch) {
    fs::path medium = arguments.output;
    if (medium.empty()) (medium = image) += "." + arguments.action;
    QDUINO_TRY(make_medium(arguments.action == "iso" ? BootWay::bios : BootWay::uefi, image,
                           image_words(arguments), scratch, medium));
    return medium;
}

Result<EmulatedRun> run_image(const Arguments& arguments, const fs::path& image, const fs::path& scratch) {
    const EmulatedMachine machine{
        .architecture = is_for_aarch64(arguments) ? Architecture::aarch64 : Architecture::x86_64,
        .cores = arguments.cores.value_or(2),
        .words = image_words(arguments),
        .record = arguments.record,
        .counted_time = arguments.counted_time,
        .wire = arguments.wire,
        .card = arguments.card,
        .forwards = arguments.forwards,
        .files = arguments.files,
        .window = arguments.window,
        .mips = arguments.mips};
    if (is_for_aarch64(arguments)) return run_in_virt(machine, image, scratch);
    const BootWay way = way_of(arguments);
    fs::path medium = image;
    if (way != BootWay::pvh) {
        medium = scratch / "medium";
        QDUINO_TRY(make_medium(way, image, machine.words, scratch, medium));
    }
    return arguments.witness == "bochs" ? run_in_bochs(machine, medium, scratch)
                                        : run_in_qemu(machine, way, medium, scratch);
}

/// Runs it, and tells what the witness saw. Returns the image's status.
Result<int> run_seen(const Arguments& arguments, const fs::path& image, const fs::path& scratch) {
    QDUINO_TRY_ASSIGN(const EmulatedRun run, run_image(arguments, image, scratch));
    if (!arguments.vcd.empty()) QDUINO_TRY(posix::write_file(arguments.vcd, value_change_dump(run.writes)));
    if (arguments.window.empty()) say(pins_table(run.writes));
    return run.status;
}

/// Boots it, and says how it ended.
Result<int> run_named(const Arguments& arguments, const fs::path& image, const std::string& name,
                      const fs::path& scratch) {
    QDUINO_TRY_ASSIGN(const int status, run_seen(arguments, image, scratch));
    say(verdict(status == 0   ? name + " ran to its end."
                : status == 2 ? name + " is REFUSED: no loop of it ran."
                              : name + " FAILED."));
    return status;
}

Result<Sdk> tools_for(const Arguments& arguments, const Sdk& sdk) {
    if (is_for_aarch64(arguments)) return for_aarch64_images(sdk);
    if (sdk.metal.libraries.empty())
        return make_error(
            ErrorCode::unavailable,
            "this QduinoMC was built without what an image needs. As root, run 'apt-get install "
            "musl-dev', and build it again; here: ",
            sdk.no_metal);
    return for_images(sdk);
}

int tell_made(const fs::path& file, const std::string& words) {
    std::printf("%s\n", file.c_str());
    std::fflush(stdout);
    say(verdict(words));
    return 0;
}

}  // namespace

bool is_image(const fs::path& path) {
    const auto bytes = fs::is_regular_file(path) ? posix::read_small_file(path) : Result<std::string>("");
    return bytes && bytes->starts_with(
                        "\x7f"
                        "ELF");
}

std::string image_words(const Arguments& arguments) {
    auto words =
        arguments.length_s ? text<std::string>("for=", Shortest{*arguments.length_s}) : std::string{};
    if (!words.empty() && !arguments.image_words.empty()) words += ' ';
    return words + arguments.image_words;
}

Result<int> metal(const Arguments& arguments, const Sdk& sdk) {
    QDUINO_TRY(is_for_aarch64(arguments) ? check_aarch64(arguments) : check_options(arguments));
    QDUINO_TRY_ASSIGN(const auto scratch,
                      board::linux::MemoryFolder::make(board::linux::MemoryFolder::kParent));
    if (const fs::path given = arguments.sketch; arguments.action == "run" && is_image(given))
        return run_named(arguments, given, given.filename(), scratch.file(""));
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(arguments.sketch));
    QDUINO_TRY_ASSIGN(Sdk tools, tools_for(arguments, sdk));
    QDUINO_TRY_ASSIGN(const SketchBuild build,
                      SketchBuild::open(std::move(tools), sketch, environment_of_this_process()));
    QDUINO_TRY_ASSIGN(const int made, build.make({BoardKind::metal}, arguments.verbose));
    const fs::path image = build.program(BoardKind::metal);
    if (arguments.action == "build")
        return tell_made(image,
                         sketch.name + (made == 0                   ? " is up to date."
                                        : is_for_aarch64(arguments) ? " is built: QEMU's virt boots it."
                                                                    : " is built: it boots by PVH."));
    if (arguments.action == "beside") return run_beside_linux(arguments, image, sketch.name);
    if (arguments.action != "run") {
        QDUINO_TRY_ASSIGN(const fs::path medium, keep_medium(arguments, image, scratch.file("")));
        return tell_made(medium, sketch.name + (arguments.action == "iso" ? " boots from a CD, by a BIOS."
                                                                          : " boots by UEFI."));
    }
    return run_named(arguments, image, sketch.name, scratch.file(""));
}

}  // namespace qduino::apps
