#include "apps/qduino/boot_medium.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "apps/qduino/child_process.h"
#include "apps/qduino/words.h"
#include "base/text.h"
#include "posix/small_file.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// Runs a tool to its end. Error: what to install, or the last of what it said.
Result<void> run_tool(const Words& command, std::string_view package, const fs::path& scratch) {
    const fs::path said = scratch / "said";
    const Result<int> ended = run_into(command, said);
    if (!ended)
        return make_error(ended.error().code, ended.error().message.view(),
                          ". As root, run 'apt-get install ", package, "'");
    if (*ended == 0) return {};
    QDUINO_TRY_ASSIGN(const std::string words, posix::read_small_file(said.string()));
    constexpr std::size_t kLast = 150;
    return make_error(ErrorCode::unavailable, command[0], " failed: ",
                      std::string_view(words).substr(words.size() - std::min(words.size(), kLast)));
}

/// boot/qduino.elf in `folder`: what is loaded of the image, without what debuggers read.
Result<fs::path> stage(const fs::path& image, const fs::path& folder, const fs::path& scratch) {
    const fs::path staged = folder / "boot" / "qduino.elf";
    std::error_code failed;
    fs::create_directories(staged.parent_path(), failed);
    if (failed) return make_error(ErrorCode::not_permitted, "no folder can be made: ", folder.native());
    QDUINO_TRY(run_tool({"strip", "-o", staged.string(), image.string()}, "binutils", scratch));
    return staged;
}

/// What GRUB does as soon as it runs: its own commands.
Result<std::string> script(const fs::path& scratch, std::string_view image, const std::string& words) {
    const std::string file = (scratch / "script").string();
    QDUINO_TRY(posix::write_file(file, text<std::string>("multiboot2 ", image, ' ', words, "\nboot\n")));
    return file;
}

}  // namespace

Result<void> make_iso(const fs::path& image, const std::string& words, const fs::path& scratch,
                      const fs::path& medium) {
    const fs::path disc = scratch / "disc";
    QDUINO_TRY(stage(image, disc, scratch));
    QDUINO_TRY_ASSIGN(const std::string commands, script(scratch, "/boot/qduino.elf", words));
    QDUINO_TRY(run_tool({"grub-mkimage", "-O", "i386-pc-eltorito", "-p", "/boot", "-c", commands, "-o",
                         (disc / "boot/loader.img").string(), "biosdisk", "iso9660", "multiboot2"},
                        "grub-common grub-pc-bin", scratch));
    return run_tool({"xorriso", "-as", "mkisofs", "-quiet", "-b", "boot/loader.img", "-no-emul-boot",
                     "-boot-load-size", "4", "-boot-info-table", "-o", medium.string(), disc.string()},
                    "xorriso", scratch);
}

Result<void> make_efi(const fs::path& image, const std::string& words, const fs::path& scratch,
                      const fs::path& medium) {
    QDUINO_TRY_ASSIGN(const fs::path staged, stage(image, scratch, scratch));
    QDUINO_TRY_ASSIGN(const std::string commands, script(scratch, "(memdisk)/qduino.elf", words));
    const std::string memory = (scratch / "memory.tar").string();
    QDUINO_TRY(
        run_tool({"tar", "-C", staged.parent_path().string(), "-cf", memory, staged.filename().string()},
                 "tar", scratch));
    return run_tool({"grub-mkimage", "-O", "x86_64-efi", "-p", "/", "-c", commands, "-m", memory, "-o",
                     medium.string(), "memdisk", "tar", "multiboot2"},
                    "grub-common grub-efi-amd64-bin", scratch);
}

}  // namespace qduino::apps
