#include "board/metal/core/kernel.h"

#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"

namespace qduino::board::metal {
namespace {

constinit std::atomic<int> cores_up{0};
constinit int first = 0;

}  // namespace

std::array<Core, kCoresMax> cores;
std::array<Thread, kVcpuLimit> threads;

void begin_with_core(int number) {
    first = number;
    cores_up.store(number);
}
int first_core() { return first; }
int core_count() { return cores_up.load(std::memory_order_acquire); }
void count_core() { cores_up.fetch_add(1, std::memory_order_release); }

bool give_work(VcpuId io, const Work& work) {
    Thread& thread = threads[io];
    if (!thread.serving.load(std::memory_order_acquire)) return false;
    if (!thread.queue.try_push(work)) {
        if (!work.after_stop) thread.lost.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    const InterruptsOff off;
    Core& core = core_of(thread);
    core.mail().work.post(io);
    core.call();
    return true;
}

void serve_work(Thread& self, const std::atomic<bool>& ended) {
    while (!ended.load(std::memory_order_relaxed)) {
        Work work;
        if (self.queue.try_pop(work)) {
            const Instant began = computer_clock.now();
            self.came = work.came;
            work.handler(work.context);
            self.times.record(work.came, began, computer_clock.now());
            continue;
        }
        // Work that comes between this look and the switch is in the mail, which the switch opens.
        const InterruptsOff off;
        if (self.queue.empty() && !ended.load(std::memory_order_relaxed)) this_core().wait_for_work();
    }
    self.serving.store(false);
    for (Work work; self.queue.try_pop(work);) {
        if (work.after_stop) work.handler(work.context);
    }
}

}  // namespace qduino::board::metal
