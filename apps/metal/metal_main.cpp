// The program around a sketch on a machine without an operating system: the same course as on Linux
// (apps/host/sketch_main.cpp), with what the loader was told in the place of a command line.
//
//   boot ─► admission, setup() ─► report ─► run ─► report ─► off: 0, 1 on failure, 2 when refused
//
//   for=S      seconds to run; without it, until the machine is turned off
#include <cstdlib>
#include <string>

#include "apps/guarantee/guarantee_report.h"
#include "apps/host/sketch_report.h"
#include "base/text.h"
#include "board/metal/boot/boot_main.h"
#include "board/metal/metal_board.h"
#include "board/metal/panic.h"
#include "runtime/runtime.h"

namespace qduino::board::metal {
/// Linked where a sketch uses the network (board/metal/net/network.cpp); null elsewhere.
[[gnu::weak]] void open_network();
}  // namespace qduino::board::metal

namespace qduino::apps::metal {
namespace {

using board::metal::MetalBoard;
using board::metal::report;
using runtime::Runtime;

/// The value of "name=value" among words that blanks separate; empty: there is none.
std::string value_of(std::string_view words, std::string_view name) {
    while (!words.empty()) {
        const std::string_view word = words.substr(0, words.find(' '));
        if (word.starts_with(name) && word.substr(name.size()).starts_with('='))
            return std::string(word.substr(name.size() + 1));
        words.remove_prefix(std::min(words.size(), word.size() + 1));
    }
    return {};
}

int refuse(const Runtime& runtime, const Error& error) {
    report(text<std::string>(error.message.view(), '\n'));
    if (runtime.plan().admitted()) return 1;  // so the board refused
    report(runtime.explanation());
    return 2;
}

int run_sketch(MetalBoard& board, Runtime& runtime, double seconds) {
    if (const Result<void> begun = runtime.begin(runtime::sketch_table()); !begun)
        return refuse(runtime, begun.error());
    report(text<std::string>(runtime.plan().admission_table(), guarantee_text(board.guarantee()), '\n'));
    runtime.run(seconds > 0 ? board.now() + from_seconds(seconds) : kForever);
    board.request_stop();
    runtime.run(board.now() + 2s);
    const board::GuaranteeReport guarantee = guarantee_of(runtime);
    const auto loops = loops_of(runtime);
    report(text<std::string>('\n', loop_table(loops), "Periods: ", periods_kept(loops, board.now()),
                             sleep_verdict(runtime), ".\n", handlers_kept(guarantee),
                             guarantee_text(guarantee)));
    return 0;
}

}  // namespace
}  // namespace qduino::apps::metal

void qduino::board::metal::metal_main(std::string_view words) {
    static MetalBoard board;
    if (open_network) open_network();
    static runtime::Runtime runtime(board);
    const double seconds = std::strtod(apps::metal::value_of(words, "for").c_str(), nullptr);
    const int status = apps::metal::run_sketch(board, runtime, seconds);
    pins.force_safe_levels();  // also when a loop has not ended
    turn_off(status);
}
