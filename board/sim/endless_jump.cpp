#include "board/sim/endless_jump.h"

#include <signal.h>
#include <sys/time.h>
#include <ucontext.h>

#include <cerrno>
#include <cstring>

#include "base/contract.h"

#if defined(__SANITIZE_THREAD__)
#define QDUINO_LATE_SIGNALS 1
#elif defined(__has_feature)
#if __has_feature(thread_sanitizer)
#define QDUINO_LATE_SIGNALS 1
#endif
#endif
#if defined(QDUINO_LATE_SIGNALS)
// The thread sanitizer calls handlers of sigaction() at the next system call, which a jump to
// itself never makes. This is the C library's own function, and comes at once.
extern "C" int __sigaction(int, const struct sigaction*, struct sigaction*);  // NOLINT
#endif

namespace qduino::board::sim {
namespace {

constexpr suseconds_t kTick_us = 10'000;

struct Watched {
    EventLoop* loop = nullptr;
    void (*hopeless)(const void*) = nullptr;
    // At the last tick, and since how many of them nothing has changed.
    Instant now = kEpoch;
    std::int32_t blocks_left = 0;
    int ticks = 0;
};
Watched watched;  // by the handler's thread alone

int set_handler(const struct sigaction& action) {
#if defined(QDUINO_LATE_SIGNALS)
    return ::__sigaction(SIGVTALRM, &action, nullptr);
#else
    return ::sigaction(SIGVTALRM, &action, nullptr);
#endif
}

const std::uint8_t* interrupted_code(const void* context) {
    [[maybe_unused]] const auto& machine = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
    return reinterpret_cast<const std::uint8_t*>(machine.gregs[REG_RIP]);
#elif defined(__aarch64__)
    return reinterpret_cast<const std::uint8_t*>(machine.pc);
#else
    return nullptr;
#endif
}

void count_tick(const std::uint8_t* code) {
    const bool moved = watched.loop->now() != watched.now || block_count.left != watched.blocks_left;
    watched.ticks = moved ? 0 : watched.ticks + 1;
    watched.now = watched.loop->now();
    watched.blocks_left = block_count.left;
    if (watched.ticks >= EndlessJumps::kHopeless && watched.hopeless) watched.hopeless(code);
}

void on_tick(int, siginfo_t*, void* context) {
    // Null on a thread of the sketch's own, and where the board's own code runs.
    if (!block_count.watch) return;
    const int error = errno;
    const std::uint8_t* const code = interrupted_code(context);
    if (code && jumps_to_itself(code)) watched.loop->spins().never_go_on(code);
    count_tick(code);
    errno = error;
}

void set_timer(suseconds_t us) {
    const itimerval timer{{0, us}, {0, us}};
    ::setitimer(ITIMER_VIRTUAL, &timer, nullptr);
}

}  // namespace

#if defined(__x86_64__)
/// Where the jump at `code` leads, behind any nops before it; null: there is no jump.
const std::uint8_t* target_of_jump(const std::uint8_t* code) {
    while (*code == 0x90) ++code;                                              // nop
    if (code[0] == 0xeb) return code + 2 + static_cast<std::int8_t>(code[1]);  // jmp rel8
    if (code[0] != 0xe9) return nullptr;                                       // jmp rel32
    std::int32_t distance = 0;
    std::memcpy(&distance, code + 1, sizeof distance);
    return code + 5 + distance;
}

bool jumps_to_itself(const std::uint8_t* code) {
    const std::uint8_t* const target = target_of_jump(code);
    // It may lead to nops before it, and must come back to the same place from there.
    return target && target <= code && code - target < 16 && target_of_jump(target) == target;
}
#elif defined(__aarch64__)
bool jumps_to_itself(const std::uint8_t* code) {
    std::uint32_t instruction = 0;
    std::memcpy(&instruction, code, sizeof instruction);
    return instruction == 0x14000000;  // b .
}
#else
bool jumps_to_itself(const std::uint8_t*) { return false; }
#endif

EndlessJumps::EndlessJumps(EventLoop& loop, void (*hopeless)(const void* place)) {
    QDUINO_EXPECT(watched.loop == nullptr);
    watched = {.loop = &loop, .hopeless = hopeless};
    struct sigaction action {};
    action.sa_sigaction = &on_tick;
    // The handler may leave for another fiber, where the next tick must come as well.
    action.sa_flags = SA_SIGINFO | SA_RESTART | SA_NODEFER;
    set_handler(action);
    set_timer(kTick_us);
}

EndlessJumps::~EndlessJumps() {
    set_timer(0);
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    set_handler(ignore);
    watched = {};
}

}  // namespace qduino::board::sim
