#include "tests/emulated/guest/run_sketch.h"

#include <cstdio>
#include <string>

#include "board/linux/linux_board.h"
#include "report/guarantee_report.h"
#include "runtime/runtime.h"

namespace qduino::emulated {
namespace {

void say(std::string_view message) {
    std::printf("emulated: %.*s\n", static_cast<int>(message.size()), message.data());
}
int fail(std::string_view message) {
    say(message);
    return 2;
}

}  // namespace

int run_sketch(board::linux::LinuxConfig config, Nanoseconds longest) {
    auto opened = board::linux::LinuxBoard::open(std::move(config));
    if (!opened) return fail(opened.error().message);
    board::linux::LinuxBoard& board = **opened;
    // An emulated processor stands still while the host does something else, and its kernel takes
    // that for interrupts: admission is told nothing true. Its verdict is shown, and not enforced.
    runtime::Runtime runtime(board, {.enforce_admission = false});
    if (Result<void> begun = runtime.begin(runtime::sketch_table()); !begun)
        return fail(begun.error().message);
    say(runtime.explanation());
    runtime.run(board.now() + longest);
    const bool stopped = board.stop_requested();
    const board::GuaranteeReport report = board.guarantee();
    std::printf("%sguarantee: %s\n", apps::guarantee_text(report).c_str(),
                apps::guarantee_json(report).c_str());
    board.request_stop();
    runtime.run(board.now() + 2s);
    return stopped ? 0 : 1;
}

}  // namespace qduino::emulated
