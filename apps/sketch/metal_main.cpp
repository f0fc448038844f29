// The program around a sketch on a machine without an operating system: the same course as on Linux
// (apps/sketch/sketch_main.cpp), with what the loader was told in the place of a command line.
//
//   boot ─► admission, setup() ─► report ─► run ─► report ─► off: 0, 1 on failure, 2 when refused,
//                                                                 3 when Linux beside it was silent
//
//   for=S      seconds to run; without it, until the machine is turned off
//   pins=lpt   pins are those of the parallel port (board/metal/driver/lpt_port.h), not virtual
//   turns=US   in QEMU with counted time: its cores take turns of so many microseconds. A core runs
//              there until the next timer of the machine, and the others stand still meanwhile; so
//              the old timer ticks, with its interrupt masked. A tick costs QEMU some 15 us.
#include <algorithm>
#include <cstdlib>
#include <string>

#include "arduino/metal/loader_words.h"
#include "base/text.h"
#include "board/metal/boot/boot_main.h"
#include "board/metal/computer/computer.h"
#include "board/metal/linux_side.h"
#include "board/metal/metal_board.h"
#include "board/metal/panic.h"
#include "board/metal/pins.h"
#include "report/chain_report.h"
#include "report/guarantee_report.h"
#include "report/lock_report.h"
#include "report/sketch_report.h"
#include "runtime/runtime.h"
#include "terminal/message.h"

namespace qduino::board::metal {
/// Linked where a sketch uses the network (board/metal/net/network.cpp); null elsewhere.
[[gnu::weak]] void open_network();
}  // namespace qduino::board::metal

namespace qduino::apps::metal {
namespace {

using board::metal::linux_side;
using board::metal::MetalBoard;
using board::metal::report;
using runtime::Runtime;

/// The pins that were asked for; the machine's own stay where nothing was.
Result<void> choose_pins() {
    const std::string wanted = arduino::metal::loader_word("pins");
    return wanted.empty() ? Result<void>{} : board::metal::lead_pins_to(wanted);
}

/// What each VCPU was charged since the loops began.
std::string charges(const board::GuaranteeReport& guarantee) {
    if (guarantee.loops.empty()) return "";
    auto out = text<std::string>("Charged in ", Fixed{1e6 * to_seconds(guarantee.loops.front().watched), 1},
                                 " us to each VCPU:");
    for (const board::LoopGuarantee& loop : guarantee.loops)
        write(out, loop.id == guarantee.loops.front().id ? " " : ", ", loop.id, " had ",
              Fixed{1e6 * to_seconds(loop.used), 1}, " us");
    return wrapped(out + ".", "");
}

/// What a board on a core that Linux gave up cannot promise.
std::string about_linux() {
    if (!linux_side.exists()) return "";
    const board::BesideArea& area = linux_side.area();
    const auto limit_ms = static_cast<double>(area.silence_limit_ns) / 1e6;
    auto out = text<std::string>("Core ", area.core,
                                 " of this computer is the board's, all else is Linux's. Memory is not "
                                 "protected from Linux: what may write to /dev/mem, and Linux itself, can "
                                 "end or change this run. The board maps no memory of Linux's. ");
    if (limit_ms > 0)
        write(out, "When Linux is silent for ", Fixed{limit_ms, 1}, " ms, the safe levels are driven.");
    else
        write(out, "When Linux is silent, the loops run on.");
    return wrapped(out, "");
}

/// The silence that ended the run.
std::string about_silence() {
    if (!linux_side.was_silent()) return "";
    const board::BesideArea& area = linux_side.area();
    const auto silent_ms = static_cast<double>(area.safe_ns.load() - area.last_beat_ns.load()) / 1e6;
    return wrapped(
        text<std::string>("Linux was silent: ", Fixed{silent_ms, 1},
                          " ms after its last heartbeat was seen, all safe levels had been driven."),
        "");
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
    report(text<std::string>(runtime.plan().admission_table(), guarantee_text(board.guarantee()),
                             about_linux()));
    runtime.run(seconds > 0 ? board.now() + from_seconds(seconds) : kForever);
    board.request_stop();
    runtime.run(board.now() + 2s);
    const board::GuaranteeReport guarantee = guarantee_of(runtime);
    const auto loops = loops_of(runtime);
    report(text<std::string>('\n', loop_table(loops), "Periods: ", periods_kept(loops, board.now()),
                             sleep_verdict(runtime), lock_verdict(runtime, runtime::sketch_table()),
                             chain_verdict(runtime), ".\n", chain_lines(runtime), handlers_kept(guarantee),
                             charges(guarantee), guarantee_text(guarantee), about_silence()));
    return linux_side.was_silent() ? static_cast<int>(board::kEndedBySilence) : 0;
}

}  // namespace
}  // namespace qduino::apps::metal

void qduino::board::metal::metal_main(std::string_view words) {
    arduino::metal::keep_loader_words(words);
    if (const std::string turn = arduino::metal::loader_word("turns"); !turn.empty())
        static_cast<void>(let_cores_take_turns(std::strtod(turn.c_str(), nullptr)));
    if (const Result<void> chosen = apps::metal::choose_pins(); !chosen) {
        report(text<std::string>(chosen.error().message.view(), '\n'));
        turn_off(1);
    }
    static MetalBoard board;
    if (!arduino::metal::loader_word("turns").empty()) board.count_spins();
    if (open_network) open_network();
    static runtime::Runtime runtime(board);
    const double seconds = std::strtod(arduino::metal::loader_word("for").c_str(), nullptr);
    const int status = apps::metal::run_sketch(board, runtime, seconds);
    pins.force_safe_levels();  // also when a loop has not ended
    turn_off(status);
}
