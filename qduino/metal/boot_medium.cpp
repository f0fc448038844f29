#include "qduino/metal/boot_medium.h"

#include <algorithm>
#include <string_view>
#include <system_error>

#include "base/text.h"
#include "posix/small_file.h"
#include "qduino/common/tool_run.h"
#include "qduino/common/words.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// boot/qduino.elf in `folder`: what is loaded of the image, without what debuggers read.
Result<fs::path> stage(const fs::path& image, const fs::path& folder, const fs::path& scratch) {
    const fs::path staged = folder / "boot" / "qduino.elf";
    std::error_code failed;
    fs::create_directories(staged.parent_path(), failed);
    if (failed) return make_error(ErrorCode::not_permitted, "no folder can be made: ", folder.native());
    QDUINO_TRY(run_tool({"strip", "-o", staged.string(), image.string()}, scratch / "said", "binutils"));
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
                        scratch / "said", "grub-common grub-pc-bin"));
    return run_tool({"xorriso", "-as", "mkisofs", "-quiet", "-b", "boot/loader.img", "-no-emul-boot",
                     "-boot-load-size", "4", "-boot-info-table", "-o", medium.string(), disc.string()},
                    scratch / "said", "xorriso");
}

Result<void> make_efi(const fs::path& image, const std::string& words, const fs::path& scratch,
                      const fs::path& medium) {
    QDUINO_TRY_ASSIGN(const fs::path staged, stage(image, scratch, scratch));
    QDUINO_TRY_ASSIGN(const std::string commands, script(scratch, "(memdisk)/qduino.elf", words));
    const std::string memory = (scratch / "memory.tar").string();
    QDUINO_TRY(
        run_tool({"tar", "-C", staged.parent_path().string(), "-cf", memory, staged.filename().string()},
                 scratch / "said", "tar"));
    return run_tool({"grub-mkimage", "-O", "x86_64-efi", "-p", "/", "-c", commands, "-m", memory, "-o",
                     medium.string(), "memdisk", "tar", "multiboot2"},
                    scratch / "said", "grub-common grub-efi-amd64-bin");
}

}  // namespace qduino::apps
