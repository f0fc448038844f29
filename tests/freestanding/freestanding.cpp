// A sketch from begin() to its end on a board without an operating system, compiled without
// exceptions and RTTI. Memory may be asked for until the board starts the loops; from then on it is
// an error, and the program says so and fails.
//
//   begin(): admission, setup() ──► board.start() ──► run(): releases, overruns, locks, budgets
//   operator new: yes                      no ───────────────────────────────────────────────►
//
// Its limit: it is linked with this computer's C++ library, whose own inside it does not look into;
// what it proves is that nothing of base/, sched/, board/ and runtime/ needs the two language
// features, nor operator new once loops run.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <new>

#include "runtime/runtime.h"
#include "sched/core_scheduler.h"
#include "tests/unit/board/bare_board.h"

namespace {

bool started = false;

void* memory(std::size_t size) {
    if (started) {
        std::fputs("memory was asked for after the start\n", stderr);
        std::_Exit(1);
    }
    void* const got = std::malloc(size);
    if (!got) std::abort();
    return got;
}

}  // namespace

void* operator new(std::size_t size) { return memory(size); }
void* operator new[](std::size_t size) { return memory(size); }
void operator delete(void* pointer) noexcept { std::free(pointer); }
void operator delete[](void* pointer) noexcept { std::free(pointer); }
void operator delete(void* pointer, std::size_t) noexcept { std::free(pointer); }
void operator delete[](void* pointer, std::size_t) noexcept { std::free(pointer); }

namespace {

using namespace qduino;

bool allocate = false;
int releases = 0;
int overruns = 0;
board::LockWord word;

/// What a loop may call: late twice, under a lock, yielding, and waiting.
void body() {
    board::Board& board = board::current();
    ++releases;
    if (allocate) delete[] new int[static_cast<std::size_t>(releases)];
    board.lock(word);
    board.busy_for(releases % 5 == 0 ? Nanoseconds{25ms} : Nanoseconds{1ms});
    board.unlock(word);
    runtime::Runtime::current()->yield();
    runtime::Runtime::current()->wait_for_next_period();
    if (releases == 20) board.request_stop();
}

void setup() {
    runtime::Runtime& runtime = *runtime::Runtime::current();
    runtime.set_overrun_policy(1, runtime::OverrunPolicy::call_back,
                               [](board::VcpuId, Nanoseconds) { ++overruns; });
    const Result<void> edges = runtime.attach_interrupt(
        board::PinId{3}, board::Edge::rising, [] {}, 1ms, 10ms, 0);
    if (edges.ok() || edges.error().code != ErrorCode::unsupported) std::abort();
}

/// What a board without a scheduler below it does at its timer: charge, decide, until the next
/// change.
Nanoseconds schedule(sched::CoreScheduler& scheduler) {
    if (!scheduler.add(1, {2ms, 10ms}) || !scheduler.add(2, {1ms, 5ms})) std::abort();
    scheduler.wake(1, kEpoch);
    scheduler.wake(2, kEpoch);
    for (Instant now = kEpoch; now < kEpoch + 100ms;) {
        now = std::min(scheduler.decide(now).until, kEpoch + 100ms);
        scheduler.account(now);
    }
    return scheduler.consumed(1) + scheduler.consumed(2);
}

}  // namespace

int main(int argc, char** argv) {
    allocate = argc == 2 && std::strcmp(argv[1], "--allocate") == 0;
    static board::test::BareBoard board;
    board.on_start = [] { started = true; };
    static runtime::Runtime runtime(board);
    static runtime::SketchTable table;
    table.setup = &setup;
    table.loops.push_back({{.id = 1, .budget = 2ms, .period = 10ms, .core = 0}, &body});
    static sched::CoreScheduler scheduler;
    if (!runtime.begin(table).ok()) return std::fputs("the sketch was refused\n", stderr), 1;
    runtime.run(kForever);
    const bool kept = schedule(scheduler) == 40ms;
    std::printf("%d releases, %d overruns, budgets %s\n", releases, overruns, kept ? "kept" : "NOT kept");
    return releases == 20 && overruns == 4 && kept ? 0 : 1;
}
