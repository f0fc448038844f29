#include "qduino/ide_command.h"

#include <cstdio>
#include <filesystem>
#include <system_error>

#include "qduino/build/tool_commands.h"
#include "qduino/ide/ide_discovery.h"
#include "qduino/ide/ide_monitor.h"
#include "qduino/ide/ide_platform.h"
#include "qduino/ide/ide_recipe.h"
#include "qduino/ide/ide_serial.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAfterInstall =
    "In the IDE (1.8), after it was started anew: Tools, Board, QduinoMC. Its sketchbook (File,\n"
    "Preferences) is to be the folder above. Without a window:\n"
    "  arduino-builder -compile -fqbn qduino:linux:here \\\n"
    "    -hardware /usr/share/arduino-builder -hardware %s \\\n"
    "    -tools /usr/share/arduino-builder SKETCH.ino\n";

}  // namespace

Result<int> ide_command(const Arguments& arguments, const Sdk& sdk) {
    if (arguments.action == "discovery") {
        IdeDiscovery discovery(ports_of(arguments.program));
        return run_ide_tool(discovery);
    }
    if (arguments.action == "serial") return ide_serial(arguments.program);
    if (arguments.action == "monitor") {
        IdeMonitor monitor;
        return run_ide_tool(monitor);
    }
    if (is_recipe(arguments.action)) return run_recipe(sdk, arguments.action, arguments.program);
    QDUINO_TRY_ASSIGN(const fs::path book, sketchbook(arguments.folder, environment_of_this_process().home));
    if (arguments.action == "remove") {
        std::printf(remove_platform(book) ? "The board is gone from %s\n" : "There was no board in %s\n",
                    book.c_str());
        return 0;
    }
    std::error_code failed;
    const fs::path program = fs::read_symlink("/proc/self/exe", failed);
    QDUINO_TRY_ASSIGN(const fs::path folder, install_platform(book, program, arguments.hosts));
    std::printf("%s\n", folder.c_str());
    std::fprintf(stderr, kAfterInstall, (book / "hardware").c_str());
    return 0;
}

}  // namespace qduino::apps
