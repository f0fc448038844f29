#include "arduino/libraries/FreeRTOS/freertos/tasks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <memory>

#include "arduino/core/diagnostics.h"
#include "arduino/core/loops.h"
#include "board/board.h"

namespace qduino::arduino::freertos {
namespace {

constexpr std::array<Nanoseconds, 4> kPeriods{40ms, 20ms, 10ms, 5ms};  // by priority
constexpr int kShare = 10;                                             // a budget's of its period

FixedVector<Task*, board::kMaxLoop> tasks;  // none is ever destroyed

/// The body of each task's loop. A task that has ended sleeps there.
void run_task() {
    Task& task = *current_task();
    if (task.deleted.load()) return board::current().sleep_until(board::current().now() + 20ms);
    if (setjmp(task.end) != 0) return;
    task.began.store(true);
    task.function(task.parameters);
    task.deleted.store(true);  // a function of FreeRTOS must not return
}

}  // namespace

Task* make_task(void (*function)(void*), const char* name, std::uint32_t stack_depth, void* parameters,
                std::uint8_t priority) {
    auto task = std::make_unique<Task>();
    task->function = function;
    task->parameters = parameters;
    task->priority = std::min<std::uint8_t>(priority, kPeriods.size() - 1);
    task->stack_depth = stack_depth;
    std::strncpy(task->name, name ? name : "", sizeof task->name - 1);
    const Nanoseconds period = kPeriods[task->priority];
    task->loop = function ? enter_loop_of_setup(period / kShare, period, &run_task, task->name) : 0;
    if (task->loop == 0) {
        refuse("xTaskCreate", static_cast<int>(tasks.size()), ErrorCode::unavailable,
               "a task needs a function, and is made in setup(), where not 32 loops are declared: ",
               std::string_view{task->name});
        return nullptr;
    }
    tasks.push_back(task.release());
    return tasks.back();
}

Task* current_task() {
    const board::VcpuId self = board::current().current_vcpu();
    const auto found = std::ranges::find_if(tasks, [self](const Task* task) { return task->loop == self; });
    return found == tasks.end() ? nullptr : *found;
}

int task_count() { return static_cast<int>(tasks.size()); }

bool sleep_a_tick() {
    board::Board& board = board::current();
    Task* const self = current_task();
    if (!self && (board.stop_requested() || board.current_vcpu() == board::kNoVcpu)) return false;
    if (self) self->blocked.store(true);
    board.sleep_until(board.now() + 1ms);
    if (!self) return true;
    while (self->suspended.load() && !self->deleted.load() && !board.stop_requested())
        board.sleep_until(board.now() + 1ms);
    self->blocked.store(false);
    if (self->deleted.load() || board.stop_requested()) std::longjmp(self->end, 1);
    return true;
}

Ticks tick_count() { return static_cast<Ticks>(board::current().now().time_since_epoch() / 1ms); }

void sleep_ticks(Ticks ticks) {
    const Ticks until = tick_count() + ticks;
    sleep_until_tick(until);
}

/// At absolute instants, so that a period does not grow by what the task does.
bool sleep_until_tick(Ticks ticks) {
    const auto is_past = [ticks] { return static_cast<std::int32_t>(ticks - tick_count()) <= 0; };
    if (is_past()) return false;
    board::Board& board = board::current();
    while (!is_past()) {
        Task* const self = current_task();
        const auto left = std::chrono::milliseconds{ticks - tick_count()};
        if (left > 2ms && self && !self->suspended.load() && !self->deleted.load()) {
            self->blocked.store(true);
            // In pieces, for somebody may end it meanwhile.
            board.sleep_until(board.now() + std::min<Nanoseconds>(left - 1ms, 20ms));
        }
        if (!sleep_a_tick()) return false;
    }
    return true;
}

void end_task(Task* task) {
    Task* const self = current_task();
    if (!task) task = self;
    if (!task) return;
    task->deleted.store(true);
    if (task == self) std::longjmp(self->end, 1);
}

void suspend_task(Task* task) {
    Task* const self = current_task();
    if (!task) task = self;
    if (!task) return;
    task->suspended.store(true);
    if (task == self) sleep_a_tick();
}

TaskState state_of(const Task& task) {
    if (task.deleted.load()) return TaskState::deleted;
    if (task.suspended.load()) return TaskState::suspended;
    if (&task == current_task()) return TaskState::running;
    return task.blocked.load() ? TaskState::blocked : TaskState::ready;
}

}  // namespace qduino::arduino::freertos
