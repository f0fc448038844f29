#include "qduino/built_sketch.h"

#include <cstdlib>
#include <cstring>
#include <system_error>
#include <utility>

#include "base/text.h"
#include "qduino/command.h"
#include "qduino/common/child_process.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

}  // namespace

Result<Sdk> sdk_of_this_program() {
    std::error_code failed;
    const char* home = std::getenv("QDUINO_HOME");
    const SdkPlaces places{.home = home ? home : "",
                           .program = fs::read_symlink("/proc/self/exe", failed),
                           .built_in = QDUINO_SDK_FILE};
    QDUINO_TRY_ASSIGN(const fs::path file, find_sdk(places));
    return read_sdk(file);
}

Result<BuiltSketch> build_sketch(const SketchOptions& options, const std::vector<BoardKind>& boards) {
    QDUINO_TRY_ASSIGN(Sdk sdk, sdk_of_this_program());
    QDUINO_TRY_ASSIGN(Sketch sketch, find_sketch(options.sketch));
    BuiltSketch built{.sdk = std::move(sdk), .sketch = std::move(sketch), .programs = {}};
    for (const BoardKind board : boards) {
        const Sdk& tools = built.sdk;
        QDUINO_TRY_ASSIGN(const SketchBuild build,
                          SketchBuild::open(board == BoardKind::sim ? for_simulator(tools) : tools,
                                            built.sketch, environment_of_this_process()));
        QDUINO_TRY_ASSIGN(const int made, build.make({board}, options.verbose));
        built.steps += made;
        built.programs.push_back(build.program(board));
    }
    return built;
}

Result<int> become_simulation(const SketchOptions& options, const BoardOption& board,
                              const PictureOptions& picture,
                              const std::function<Words(const Sketch&)>& words) {
    QDUINO_TRY(picture.check());
    if (const ReadBoardFile read = board.read(); !read.ok()) return say_failed(read.error);
    QDUINO_TRY_ASSIGN(const BuiltSketch built, build_sketch(options, {BoardKind::sim}));
    Words command{built.programs[0].string()};
    append(command, words(built.sketch));
    return become(command);
}

std::string end_of(const std::string& name, int status) {
    if (status == 0) return name + " ran to its end.";
    if (status == 2) return name + " is REFUSED: no loop of it ran.";
    if (status <= 128) return text<std::string>(name, " FAILED with status ", status, '.');
    const char* signal = ::strsignal(status - 128);
    return text<std::string>(name, " DIED of signal ", status - 128, " (", signal ? signal : "unknown", ").");
}

}  // namespace qduino::apps
