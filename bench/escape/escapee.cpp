// escape-patterns: a sketch's three loops on the last core. Loop 1 (1 ms in 10 ms) does what the
// pattern says; loop 2 (4 ms in 40 ms), below it, and loop 3 (0.4 ms in 4 ms), above it, keep to
// their budgets. bench-escape and a test judge it from outside.
//
//   escape-patterns PATTERN SECONDS REPORT [--without-warden]
//
// Writes "runs\n" to standard output when the loops begin, and the guarantee report, as JSON, at
// the end. Before that, "worst N\n": after how many µs the latest release of loop 3 ended. Its
// loops need not end: the process does.
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <string_view>

#include "bench/escape/patterns.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"
#include "report/guarantee_report.h"

namespace {

using namespace qduino;
using board::VcpuSpec;
using board::linux::LinuxBoard;

const bench::EscapePattern* g_pattern = nullptr;

void escape(void* board) { g_pattern->run(*static_cast<LinuxBoard*>(board)); }

void keep_to_budget(void* self) {
    auto& board = *static_cast<LinuxBoard*>(self);
    for (Instant release = board.now(); !board.stop_requested(); release += 40ms) {
        board.sleep_until(release);
        board.busy_for(2ms);
    }
}

std::atomic<std::int64_t> g_worst_ns{0};

void keep_above(void* self) {
    auto& board = *static_cast<LinuxBoard*>(self);
    for (Instant release = board.now(); !board.stop_requested(); release += 4ms) {
        board.sleep_until(release);
        board.note_release(release);
        const Nanoseconds enough = board.cpu_time() + 200us;
        while (board.cpu_time() < enough) {
        }
        const Nanoseconds took = board.now() - release;
        if (to_ns(took) > g_worst_ns) g_worst_ns = to_ns(took);
        if (took > 4ms) board.note_overrun(took - 4ms);
        while (board.now() > release + 4ms) release += 4ms;
    }
}

VcpuSpec loop(board::VcpuId id, Nanoseconds budget, Nanoseconds period, void (*entry)(void*),
              LinuxBoard& board) {
    VcpuSpec spec;
    spec.id = id;
    spec.budget = budget;
    spec.period = period;
    spec.core = board.core_count() - 1;
    spec.entry = entry;
    spec.context = &board;
    return spec;
}

int run(double seconds, const char* report, bool warden) {
    board::linux::LinuxConfig config;
    config.warden = warden;
    auto opened = LinuxBoard::open(config);
    if (!opened) return 1;
    LinuxBoard& board = **opened;
    if (g_pattern->prepare) g_pattern->prepare();
    static_cast<void>(board.platform_overheads(0));
    if (!board.start(std::array{loop(1, 1ms, 10ms, escape, board), loop(2, 4ms, 40ms, keep_to_budget, board),
                                loop(3, 400us, 4ms, keep_above, board)}))
        return 1;
    std::puts("runs");
    std::fflush(stdout);
    board.run(board.now() + from_seconds(seconds));
    std::printf("worst %lld\n", static_cast<long long>(g_worst_ns / 1000));
    std::fflush(stdout);
    const bool written = apps::write_guarantee(board.guarantee(), report).ok();
    const auto end = board.guarantee();
    std::fputs((apps::delays_explained(end) + apps::budgets_kept(end)).c_str(), stderr);
    ::_exit(written ? 0 : 1);
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 4) return 100;
    for (const bench::EscapePattern& pattern : bench::escape_patterns()) {
        if (std::string_view{argv[1]} == pattern.name) g_pattern = &pattern;
    }
    if (!g_pattern) return 100;
    return run(std::atof(argv[2]), argv[3], argc < 5 || std::string_view{argv[4]} != "--without-warden");
}
