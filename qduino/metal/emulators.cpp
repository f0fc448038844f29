#include "qduino/metal/emulators.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <string_view>
#include <system_error>

#include "base/text.h"
#include "board/window/pins_layout.h"
#include "posix/small_file.h"
#include "qduino/common/child_process.h"
#include "qduino/common/words.h"
#include "qduino/trace/gpio_trace.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

// ---- QEMU ---------------------------------------------------------------------------------------

/// A count of instructions is the time: 2^4 ns each (QEMU's -icount).
constexpr const char* kCountedTime = "shift=4,sleep=off";
/// Where time is counted, the date is counted, too: a run is the same on every day.
constexpr const char* kCountedDate = "base=2000-01-01T00:00:00,clock=vm";
/// Debian's ovmf.
constexpr const char* kUefiFirmware = "/usr/share/ovmf/OVMF.fd";

/// A file's name within an option of the emulator, where a comma ends a part.
std::string part(const std::string& path) {
    std::string out;
    for (const char c : path) out.append(c == ',' ? 2 : 1, c);
    return out;
}

/// What the firmware boots from.
Result<Words> boot_words(const EmulatedMachine& machine, BootWay way, const fs::path& medium,
                         const fs::path& scratch) {
    if (way == BootWay::pvh) return Words{"-kernel", medium.string(), "-append", machine.words};
    if (way == BootWay::bios) return Words{"-cdrom", part(medium.string()), "-boot", "d"};
    if (!fs::exists(kUefiFirmware))
        return make_error(ErrorCode::not_found, "no UEFI firmware: as root, run 'apt-get install ovmf'. ",
                          "Missing: ", kUefiFirmware);
    const fs::path disk = scratch / "disk";
    std::error_code failed;
    fs::create_directories(disk / "EFI/BOOT", failed);
    fs::copy_file(medium, disk / "EFI/BOOT/BOOTX64.EFI", failed);
    if (failed) return make_error(ErrorCode::not_permitted, "cannot write to ", disk.native());
    return Words{"-bios", kUefiFirmware, "-drive", "format=raw,if=virtio,file=fat:rw:" + part(disk.string())};
}

/// A card, behind a router that the emulator plays: it gives the computer its address, and leads to
/// the ports of this computer that are forwarded (127.0.0.1 alone).
Words network_words(const EmulatedMachine& machine) {
    std::string router = "user,id=net";
    for (const std::string& forward : machine.forwards) {
        const std::size_t colon = forward.find(':');
        router += ",hostfwd=tcp:127.0.0.1:" + forward.substr(0, colon) + "-:" + forward.substr(colon + 1);
    }
    const std::string card = machine.card == "e1000" ? "e1000" : "virtio-net-pci";
    return {"-netdev", router, "-device", card + ",netdev=net,romfile="};
}

/// Memory that is a file's. The computer finds it as the first region of a PCI device.
Words window_words(const std::string& pins) {
    return {"-object",
            text<std::string>("memory-backend-file,id=window,size=", board::kPinsFileSize,
                              ",share=on,mem-path=", part(pins)),
            "-device", "ivshmem-plain,memdev=window"};
}

/// As board/metal/driver/emulator_files.h reads them: "opt/qduino/" and the path in the folder.
Words file_words(const fs::path& folder) {
    Words words;
    std::error_code failed;
    for (const auto& entry : fs::recursive_directory_iterator{folder, failed}) {
        if (!entry.is_regular_file()) continue;
        append(words, {"-fw_cfg", "name=" + part("opt/qduino/" + fs::relative(entry, folder).string()) +
                                      ",file=" + part(entry.path().string())});
    }
    return words;
}

/// The computer that the sketch's loops run on, its serial line here, and a witness at its pins.
Result<Words> qemu_words(const EmulatedMachine& machine, BootWay way, const fs::path& medium,
                         const fs::path& scratch, const std::string& record) {
    QDUINO_TRY_ASSIGN(const Words boot, boot_words(machine, way, medium, scratch));
    Words words{"qemu-system-x86_64", "-machine", "q35", "-cpu", "max", "-m", "128"};
    append(words, {"-smp", std::to_string(machine.cores), "-display", "none", "-nodefaults", "-no-reboot"});
    append(words, boot);
    if (machine.counted_time) append(words, {"-icount", kCountedTime});
    if (machine.counted_time && machine.forwards.empty()) append(words, {"-rtc", kCountedDate});
    append(words, {"-serial", "stdio"});
    if (!machine.wire.empty())
        append(words, {"-serial", "unix:" + part(machine.wire) + ",server=on,wait=off"});
    // Reports go beside the sketch's words: to standard error.
    append(words, {"-chardev", "file,id=report,path=/dev/fd/2,append=on", "-device",
                   "isa-debugcon,iobase=0xe9,chardev=report"});
    append(words, {"-chardev", "file,id=pins,path=" + part(record), "-device",
                   "isa-debugcon,iobase=0x2e8,chardev=pins"});
    append(words, {"-device", "isa-debug-exit,iobase=0xf4,iosize=0x01"});
    if (!machine.card.empty() || !machine.forwards.empty()) append(words, network_words(machine));
    if (!machine.files.empty()) append(words, file_words(machine.files));
    if (!machine.window.empty()) append(words, window_words(machine.window));
    return words;
}

/// QEMU's machine `virt`: pins are those of its PL061, and reports go the debugger's way.
Words virt_words(const EmulatedMachine& machine, const fs::path& image, const fs::path& trace) {
    Words words{"qemu-system-aarch64", "-machine", "virt,gic-version=2", "-cpu", "cortex-a53", "-m", "128"};
    append(words, {"-smp", std::to_string(machine.cores), "-display", "none", "-nodefaults", "-no-reboot"});
    append(words, {"-kernel", image.string(), "-append", "semihosting " + machine.words});
    if (machine.counted_time) append(words, {"-icount", kCountedTime, "-rtc", kCountedDate});
    append(words, {"-serial", "stdio"});
    append(words, {"-chardev", "file,id=report,path=/dev/fd/2,append=on", "-semihosting-config",
                   "enable=on,target=native,chardev=report"});
    append(words, {"-trace", "pl061_set_output", "-D", trace.string()});
    return words;
}

/// The emulator ends with 2·status + 1 when the image has turned the computer off, with 0 when
/// Ctrl-C has.
int status_of_machine(int ended) { return ended == 0 ? 0 : ended % 2 == 1 ? ended / 2 : 1; }

/// The emulator opens standard error a second time. Where that is a file, each of the two would
/// write over the other's words.
void append_to_standard_error() {
    ::fcntl(STDERR_FILENO, F_SETFL, ::fcntl(STDERR_FILENO, F_GETFL) | O_APPEND);
}

// ---- Bochs --------------------------------------------------------------------------------------

/// Bochs' router reads its ports in a file. The first line is its mark.
std::string bochs_router(const std::vector<std::string>& forwards) {
    std::string router = "# slirp config\n";
    for (const std::string& forward : forwards) {
        const std::size_t colon = forward.find(':');
        write(router, "hostfwd = tcp:127.0.0.1:", forward.substr(0, colon), "-:", forward.substr(colon + 1),
              '\n');
    }
    return router;
}

/// The Haswell model has x2APIC and TSC deadline. Without forwards the card hangs on a network that
/// is inside of the emulator: nothing leaves it, and a run is the same every time.
/// `unmapped=report`: the log has a line for each write to a port without a device, which is what
/// the pins are.
std::string bochs_configuration(const EmulatedMachine& machine, const fs::path& medium,
                                const fs::path& scratch) {
    const std::string& folder = scratch.native();
    return text<std::string>(
        "plugin_ctrl: unmapped=1, serial=1, e1000=1, parallel=0, speaker=0, extfpuirq=1, biosdev=1\n"
        "config_interface: textconfig\n"
        "display_library: term, options=\"hideIPS\"\n"
        "memory: guest=128, host=128\n"
        "boot: cdrom\n"
        "ata0: enabled=1, ioaddr1=0x1f0, ioaddr2=0x3f0, irq=14\n"
        "ata0-master: type=cdrom, path=\"",
        medium.native(),
        "\", status=inserted\n"
        "cpu: model=corei7_haswell_4770, reset_on_triple_fault=0, count=",
        machine.cores, ", ips=", machine.mips * 1'000'000,
        "\n"
        "clock: sync=none, time0=946681200\n"
        "pci: enabled=1, chipset=i440fx, slot1=e1000\n"
        "e1000: enabled=1, mac=52:54:00:12:34:56, ethmod=",
        machine.forwards.empty() ? "vnet" : "slirp", ", ethdev=\"", folder, "\", script=\"",
        machine.forwards.empty() ? std::string{} : folder + "/router",
        "\"\n"
        "com1: enabled=1, mode=file, dev=\"",
        folder,
        "/serial\"\n"
        "log: \"",
        folder,
        "/log\"\n"
        "logprefix: %t%e%d\n"
        "debug: action=ignore, unmapped=report\n"
        "info: action=ignore\n"
        "error: action=report\n"
        "panic: action=fatal\n");
}

}  // namespace

Result<EmulatedRun> run_in_qemu(const EmulatedMachine& machine, BootWay way, const fs::path& medium,
                                const fs::path& scratch) {
    const std::string record = machine.record.empty() ? (scratch / "pins").string() : machine.record;
    QDUINO_TRY_ASSIGN(const Words words, qemu_words(machine, way, medium, scratch, record));
    append_to_standard_error();
    const Result<int> ended = run_in_front(words);
    if (!ended)
        return make_error(ErrorCode::not_found,
                          "no emulator: as root, run 'apt-get install qemu-system-x86'. ",
                          ended.error().message.view());
    QDUINO_TRY_ASSIGN(const std::string seen, posix::read_small_file(record));
    return EmulatedRun{.status = status_of_machine(*ended), .writes = writes_of(seen)};
}

Result<EmulatedRun> run_in_virt(const EmulatedMachine& machine, const fs::path& image,
                                const fs::path& scratch) {
    GpioTrace trace;
    QDUINO_TRY(trace.begin(scratch / "trace"));
    append_to_standard_error();
    const Result<int> ended = run_in_front(virt_words(machine, image, scratch / "trace"));
    EmulatedRun run{.status = 0, .writes = trace.end()};
    if (!ended)
        return make_error(ErrorCode::not_found,
                          "no emulator: as root, run 'apt-get install qemu-system-arm'. ",
                          ended.error().message.view());
    run.status = *ended;
    if (!machine.record.empty()) QDUINO_TRY(posix::write_file(machine.record, bytes_of(run.writes)));
    return run;
}

Result<EmulatedRun> run_in_bochs(const EmulatedMachine& machine, const fs::path& medium,
                                 const fs::path& scratch) {
    const auto file = [&scratch](const char* name) { return (scratch / name).string(); };
    QDUINO_TRY(posix::write_file(file("configuration"), bochs_configuration(machine, medium, scratch)));
    QDUINO_TRY(posix::write_file(file("router"), bochs_router(machine.forwards)));
    // Debian's Bochs is the one with the debugger, which waits for an order to begin. It opens a
    // terminal for its screen, which nobody reads: one that can hide its cursor would be told so
    // many times a second until it is full, and the run would stand still after a minute.
    QDUINO_TRY(posix::write_file(file("orders"), "c\n"));
    const Words words{"sh",
                      "-c",
                      "TERM=vt100 exec bochs -q -f \"$1\" -rc \"$2\" >\"$3\" 2>&1 </dev/null",
                      "sh",
                      file("configuration"),
                      file("orders"),
                      file("said")};
    QDUINO_TRY_ASSIGN(const int ended, run_in_front(words));
    constexpr int kNotFound = 127;  // of a shell
    if (ended == kNotFound)
        return make_error(ErrorCode::not_found,
                          "no emulator: as root, run 'apt-get install bochs bochs-term bochsbios vgabios'");
    QDUINO_TRY_ASSIGN(const std::string log, posix::read_small_file(file("log")));
    if (const auto serial = posix::read_small_file(file("serial")); serial)
        std::fwrite(serial->data(), 1, serial->size(), stdout);
    std::fflush(stdout);
    BochsLog read = read_bochs_log(log, 1000 / machine.mips);
    if (!machine.record.empty()) QDUINO_TRY(posix::write_file(machine.record, bytes_of(read.writes)));
    return EmulatedRun{.status = read.status.value_or(1), .writes = std::move(read.writes)};
}

}  // namespace qduino::apps
