#include "qduino/ide/ide_platform.h"

#include <algorithm>
#include <cctype>
#include <system_error>

#include "base/version.h"
#include "posix/small_file.h"
#include "qduino/ide/ide_tool.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

// The IDE uploads with a programmer where a board has no protocol (SerialUploader.java of 1.8.19),
// so there is one, of no meaning. A program may be as large as it likes.
constexpr std::string_view kBoard = R"(.build.board=QDUINO
.build.core=qduino
.upload.tool=qduino
.upload.protocol=qduino
.upload.maximum_size=2000000000
.upload.to=)";

constexpr std::string_view kPlatform = R"(
# The core is empty: headers, libraries and options are those of the program above.
compiler.warning_flags=
compiler.warning_flags.none=-w
compiler.warning_flags.default=
compiler.warning_flags.more=-Wall
compiler.warning_flags.all=-Wall -Wextra
compiler.libraries.ldflags=

recipe.preproc.macros="{qduino}" ide preprocess "{build.source.path}" "{source_file}" "{preprocessed_file_path}" {includes}
recipe.cpp.o.pattern="{qduino}" ide compile "{build.path}" "{build.source.path}" "{source_file}" "{object_file}" {compiler.warning_flags} {includes}
recipe.c.o.pattern="{qduino}" ide compile "{build.path}" "{build.source.path}" "{source_file}" "{object_file}" {compiler.warning_flags} {includes}
recipe.S.o.pattern="{qduino}" ide compile "{build.path}" "{build.source.path}" "{source_file}" "{object_file}" {compiler.warning_flags} {includes}
recipe.ar.pattern=ar rcs "{archive_file_path}" "{object_file}"
recipe.c.combine.pattern="{qduino}" ide link "{build.path}" "{build.project_name}" {object_files} "{archive_file_path}" {compiler.libraries.ldflags}
recipe.hooks.linking.postlink.1.pattern="{qduino}" ide check "{build.path}" "{build.project_name}"
recipe.size.pattern="{qduino}" ide size "{build.path}" "{build.project_name}"
recipe.size.regex=^(?:\.text|\.data|\.rodata)\s+([0-9]+).*

tools.qduino.upload.params.verbose=
tools.qduino.upload.params.quiet=
tools.qduino.upload.pattern="{qduino}" upload {upload.to} --built "{build.path}/{build.project_name}"
)";

fs::path platform_folder(const fs::path& sketchbook) { return sketchbook / "hardware" / "qduino" / "linux"; }

std::string board_text(const std::string& id, const std::string& name, const std::string& to) {
    std::string text = id + ".name=QduinoMC (" + name + ")\n";
    for (std::size_t from = 0; from < kBoard.size();) {
        const std::size_t end = std::min(kBoard.find('\n', from), kBoard.size() - 1) + 1;
        text += id + std::string(kBoard.substr(from, end - from));
        from = end;
    }
    // By this IDE 2 knows which board a port has (ide_discovery.h).
    return text + to + "\n" + id + ".upload_port.board=" + id + "\n\n";
}

}  // namespace

// A property's name: letters and digits alone.
std::string board_id_of(const std::string& host) {
    std::string id = "to_";
    for (const char c : host) id += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    return id;
}

std::string boards_text(const std::vector<std::string>& hosts) {
    std::string text = board_text(kBoardHere, "this computer", "");
    for (const std::string& host : hosts) text += board_text(board_id_of(host), host, "--to " + host);
    return text;
}

std::string platform_text(const std::string& program, const std::vector<std::string>& hosts) {
    std::string text = "# Written by 'qduino ide install'.\nname=QduinoMC\nversion=";
    text.append(version()).append("\nqduino=").append(program).append("\n");
    text.append("tools.qduino.qduino=").append(program).append("\n").append(kPlatform);
    const std::string tool = "=\"" + program + "\" ide ";
    std::string named;
    for (const std::string& host : hosts) named += " " + host;
    text += "\npluggable_discovery.qduino.pattern" + tool + "discovery" + named;
    text.append("\npluggable_monitor.pattern.").append(kIdeProtocol).append(tool).append("monitor");
    return text + "\n# The IDE 1.8 (ide_serial.h).\ndiscovery.qduino.pattern" + tool + "serial" + named +
           "\n";
}

Result<fs::path> sketchbook(const std::string& named, const std::string& home) {
    if (!named.empty()) return fs::absolute(named);
    if (!home.empty()) return fs::path(home) / "Arduino";
    return make_error(ErrorCode::not_found, "no sketchbook: set HOME, or name its folder");
}

Result<fs::path> install_platform(const fs::path& sketchbook, const std::string& program,
                                  const std::vector<std::string>& hosts) {
    const fs::path folder = platform_folder(sketchbook);
    std::error_code failed;
    fs::create_directories(folder / "cores" / "qduino", failed);
    QDUINO_TRY(posix::write_file(folder / "boards.txt", boards_text(hosts)));
    QDUINO_TRY(posix::write_file(folder / "platform.txt", platform_text(program, hosts)));
    return folder;
}

bool remove_platform(const fs::path& sketchbook) {
    std::error_code failed;
    const bool there = fs::remove_all(platform_folder(sketchbook), failed) > 0;
    fs::remove(platform_folder(sketchbook).parent_path(), failed);  // where nobody else is in it
    return there;
}

}  // namespace qduino::apps
