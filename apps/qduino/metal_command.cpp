#include "apps/qduino/metal_command.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <filesystem>

#include "apps/launcher/run_lock.h"
#include "apps/qduino/child_process.h"
#include "apps/qduino/sketch_build.h"
#include "apps/qduino/words.h"
#include "apps/terminal/human.h"
#include "apps/terminal/message.h"
#include "board/types.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kEmulator = "qemu-system-x86_64";
/// A count of instructions is the time: 2^4 ns each (QEMU's -icount).
constexpr const char* kCountedTime = "shift=4,sleep=off";

/// What the witness at the pins' port has seen (board/metal/pins.h): a byte for each write, the
/// level in its highest bit.
struct SeenPin {
    long long writes = 0;
    long long rises = 0;
    bool high = false;
};

std::string pins_text(std::string_view record) {
    std::array<SeenPin, board::kPinCount> pins;
    for (const char c : record) {
        const auto byte = static_cast<std::uint8_t>(c);
        SeenPin& pin = pins[byte & 0x7f];
        const bool high = (byte & 0x80) != 0;
        ++pin.writes;
        pin.rises += high && !pin.high ? 1 : 0;
        pin.high = high;
    }
    std::string out = "Pins, as seen from outside the machine:\n  pin   writes    rises  level at the end\n";
    for (std::size_t i = 0; i < pins.size(); ++i) {
        if (pins[i].writes == 0) continue;
        write(out, "  ", column(i, -3), ' ', column(pins[i].writes, 8), ' ', column(pins[i].rises, 8),
              pins[i].high ? "  high\n" : "  low\n");
    }
    return out;
}

/// A file's name within an option of the emulator, where a comma ends a part.
std::string part(const std::string& path) {
    std::string out;
    for (const char c : path) out.append(c == ',' ? 2 : 1, c);
    return out;
}

/// The machine: what the sketch's loops run on, its serial line here, and a witness at its pins.
Words machine_words(const Arguments& arguments, const fs::path& image, const std::string& record) {
    const std::string cores = std::to_string(arguments.cores.value_or(2));
    Words words{kEmulator, "-machine", "q35", "-cpu", "max", "-m", "128", "-smp", cores};
    append(words, {"-display", "none", "-nodefaults", "-no-reboot", "-kernel", image.string()});
    if (arguments.length_s)
        append(words, {"-append", text<std::string>("for=", Shortest{*arguments.length_s})});
    if (arguments.counted_time) append(words, {"-icount", kCountedTime});
    append(words, {"-serial", "stdio"});
    if (!arguments.wire.empty())
        append(words, {"-serial", "unix:" + part(arguments.wire) + ",server=on,wait=off"});
    // Reports go beside the sketch's words: to standard error.
    append(words, {"-chardev", "file,id=report,path=/dev/fd/2,append=on", "-device",
                   "isa-debugcon,iobase=0xe9,chardev=report"});
    append(words, {"-chardev", "file,id=pins,path=" + part(record), "-device",
                   "isa-debugcon,iobase=0x2e8,chardev=pins"});
    append(words, {"-device", "isa-debug-exit,iobase=0xf4,iosize=0x01"});
    return words;
}

/// What the machine's end says: 2·status + 1 when the image has turned it off, 0 when Ctrl-C has.
int status_of_machine(int ended) { return ended == 0 ? 0 : ended % 2 == 1 ? ended / 2 : 1; }

/// The emulator opens standard error a second time. Where that is a file, each of the two would
/// write over the other's words.
void append_to_standard_error() {
    ::fcntl(STDERR_FILENO, F_SETFL, ::fcntl(STDERR_FILENO, F_GETFL) | O_APPEND);
}

Result<int> run_image(const Arguments& arguments, const fs::path& image) {
    QDUINO_TRY_ASSIGN(const auto folder, launcher::MemoryFolder::make(launcher::MemoryFolder::kParent, ""));
    const std::string record = arguments.record.empty() ? folder.file("pins").string() : arguments.record;
    append_to_standard_error();
    const Result<int> ended = run_in_front(machine_words(arguments, image, record));
    if (!ended)
        return make_error(ErrorCode::not_found,
                          "no emulator: as root, run 'apt-get install qemu-system-x86'. ",
                          ended.error().message.view());
    QDUINO_TRY_ASSIGN(const std::string seen, posix::read_small_file(record));
    say(pins_text(seen));
    return status_of_machine(*ended);
}

}  // namespace

Result<int> metal(const Arguments& arguments, const Sdk& sdk) {
    if (sdk.metal.libraries.empty())
        return make_error(
            ErrorCode::unavailable,
            "this QduinoMC was built without what an image needs. As root, run 'apt-get install "
            "musl-dev', and build it again; here: ",
            sdk.no_metal);
    QDUINO_TRY_ASSIGN(const Sketch sketch, find_sketch(arguments.sketch));
    QDUINO_TRY_ASSIGN(const SketchBuild build,
                      SketchBuild::open(for_images(sdk), sketch, environment_of_this_process()));
    QDUINO_TRY_ASSIGN(const int made, build.make({BoardKind::metal}, arguments.verbose));
    const fs::path image = build.program(BoardKind::metal);
    if (arguments.action == "build") {
        std::printf("%s\n", image.c_str());
        std::fflush(stdout);
        say(verdict(sketch.name + (made == 0 ? " is up to date." : " is built: it boots by PVH.")));
        return 0;
    }
    QDUINO_TRY_ASSIGN(const int status, run_image(arguments, image));
    say(verdict(status == 0   ? sketch.name + " ran to its end."
                : status == 2 ? sketch.name + " is REFUSED: no loop of it ran."
                              : sketch.name + " FAILED."));
    return status;
}

}  // namespace qduino::apps
