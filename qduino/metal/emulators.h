// An image in an emulated computer: what runs it, and what a witness outside of it saw at the pins.
//
//   QEMU    fast; time is the host's, or a count of instructions; inputs can be driven; no clock at
//           the pins
//   Bochs   one instruction is one tick, on all cores in parallel; every write to a pin is logged
//           with its tick; the same to the tick in every run
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "qduino/trace/pin_record.h"

namespace qduino::apps {

/// By which way the firmware comes to the image.
enum class BootWay { pvh, bios, uefi };

enum class Architecture { x86_64, aarch64 };

struct EmulatedMachine {
    Architecture architecture = Architecture::x86_64;
    int cores = 2;
    std::string words;   ///< the image's command line; a medium has its own
    std::string record;  ///< keeps a byte for each write to a pin; empty: nowhere

    // QEMU:
    bool counted_time = false;          ///< time is a count of instructions
    std::string wire;                   ///< a socket through which pins are driven; empty: none
    std::string card;                   ///< "virtio-net" or "e1000"; empty: none, or the first
    std::vector<std::string> forwards;  ///< TCP ports here that are ports there, "8080:80"
    std::string files;                  ///< a folder whose files the computer can read; empty: none
    std::string window;  ///< virtual pins (board/window/pins_layout.h) that it shares; empty: none

    // Bochs:
    int mips = 20;  ///< so many instructions of each core are a microsecond
};

struct EmulatedRun {
    int status = 0;  ///< with which the image has turned the computer off; 1 when it did not
    std::vector<PinWrite> writes;
};

/// Runs `medium` (an image, an ISO or an EFI program) to its end, with Serial on this terminal and
/// reports on standard error. `scratch`: a folder in memory. Error: there is no emulator, or no
/// firmware for it: what to do.
[[nodiscard]] Result<EmulatedRun> run_in_qemu(const EmulatedMachine& machine, BootWay way,
                                              const std::filesystem::path& medium,
                                              const std::filesystem::path& scratch);
/// An image for aarch64, in QEMU's machine `virt`. Only changes of a pin are seen.
[[nodiscard]] Result<EmulatedRun> run_in_virt(const EmulatedMachine& machine,
                                              const std::filesystem::path& image,
                                              const std::filesystem::path& scratch);
/// As run_in_qemu(), from an ISO. What comes over the serial line is said at the end, reports too.
[[nodiscard]] Result<EmulatedRun> run_in_bochs(const EmulatedMachine& machine,
                                               const std::filesystem::path& medium,
                                               const std::filesystem::path& scratch);

}  // namespace qduino::apps
