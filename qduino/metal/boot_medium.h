// What firmware boots an image from: GRUB, which reads the image and hands it the multiboot2 way.
//
//   image ─► stripped ─┬─► /boot/qduino.elf beside GRUB for a BIOS, on a CD's image    ISO
//                      └─► inside GRUB for UEFI, one file                              BOOTX64.EFI
//
// El Torito Bootable CD-ROM Format Specification 1.0; UEFI Specification 2.10, 3.5.1.1 (the file's
// name and place on a removable medium: \EFI\BOOT\BOOTX64.EFI). GRUB's and libburnia's own tools
// make them.
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"

namespace qduino::apps {

/// Makes `medium`, an ISO 9660 file system that a BIOS boots. `words`: the image's command line.
/// `scratch`: an empty folder. Error: which tool is missing, and the package that has it; or a
/// tool's words.
Result<void> make_iso(const std::filesystem::path& image, const std::string& words,
                      const std::filesystem::path& scratch, const std::filesystem::path& medium);
/// As make_iso(), but one program that UEFI firmware starts.
Result<void> make_efi(const std::filesystem::path& image, const std::string& words,
                      const std::filesystem::path& scratch, const std::filesystem::path& medium);

}  // namespace qduino::apps
