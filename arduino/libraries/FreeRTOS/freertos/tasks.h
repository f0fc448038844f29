// Tasks of FreeRTOS over loops (Arduino_FreeRTOS.h).
//
//   xTaskCreate() in setup() ──► a loop of its own: priority 3 has 0.5 ms in each 5 ms, 2 has 1 in
//                                10, 1 has 2 in 20, 0 has 4 in 40 (rate monotonic: a shorter period
//                                ranks higher), admitted and enforced like every other
//   a call that waits        ──► the loop sleeps, and looks at each tick of 1 ms
//
// A task that was deleted, or whose sketch is to end, leaves its function in the next call that
// waits, by longjmp(): as with FreeRTOS, destructors of what it held are not run.
#pragma once

#include <atomic>
#include <csetjmp>
#include <cstddef>
#include <cstdint>

#include "base/fixed_vector.h"
#include "board/types.h"

namespace qduino::arduino::freertos {

using Ticks = std::uint32_t;  ///< of 1 ms
inline constexpr Ticks kForeverTicks = 0xffff'ffff;

enum class TaskState : std::uint8_t { running, ready, blocked, suspended, deleted };

struct Task {
    void (*function)(void*) = nullptr;
    void* parameters = nullptr;
    char name[16]{};
    std::uint8_t priority = 0;
    board::VcpuId loop = board::kNoVcpu;
    std::uint32_t stack_depth = 0;

    std::atomic<bool> suspended{false}, deleted{false}, blocked{false}, began{false};
    std::atomic<std::uint32_t> notified{0};
    std::atomic<bool> notification_waits{false};
    std::jmp_buf end{};
};

/// In setup(). Null: setup() is over, there is no function, or there are 32 loops; it is reported.
Task* make_task(void (*function)(void*), const char* name, std::uint32_t stack_depth, void* parameters,
                std::uint8_t priority);
/// The task that calls; null: another loop, a handler, or setup().
Task* current_task();
int task_count();

/// One tick of the calling task asleep. It does not return where the task has ended. False: the
/// sketch is to end, and the caller is no task; or it is setup(), where nobody else runs.
bool sleep_a_tick();
/// Until `done()`, `ticks` at most: what `done()` said last.
template <typename Done>
bool wait_until(Ticks ticks, Done done) {
    for (Ticks waited = 0;; ++waited) {
        if (done()) return true;
        if ((ticks != kForeverTicks && waited >= ticks) || !sleep_a_tick()) return false;
    }
}

void sleep_ticks(Ticks ticks);
/// To `ticks` since the board's begin. False: that is past.
bool sleep_until_tick(Ticks ticks);
[[nodiscard]] Ticks tick_count();
/// null: the caller.
void end_task(Task* task);
void suspend_task(Task* task);
[[nodiscard]] TaskState state_of(const Task& task);

}  // namespace qduino::arduino::freertos
