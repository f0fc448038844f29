#include "board/metal/boot/boot_main.h"

#include <algorithm>
#include <atomic>

#include "base/contract.h"
#include "base/text.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/computer.h"
#include "board/metal/computer/paging.h"
#include "board/metal/core/kernel.h"
#include "board/metal/library/heap.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/linux_side.h"
#include "board/metal/panic.h"

extern "C" {
// image.ld of the architecture
extern void (*constructors[])();
extern void (*constructors_end[])();
extern std::uint8_t image_end[];

[[noreturn]] void boot_main(std::uint64_t magic, std::uint64_t told_at);
[[noreturn]] void core_main();
/// entry.S: on the stack that ends at `top`; what was on this one is over.
[[noreturn]] void go_on_at(std::uint64_t top, void (*function)());
}

namespace qduino::board::metal {
namespace {

constexpr std::uint64_t kMapped = std::uint64_t{1} << 32;  // entry.S maps so much

constinit BootFacts facts{};
constinit std::atomic<Core*> starting{nullptr};  // what the next core is to be

/// A core that does not come up within a second stays out, also when it comes later. So do those
/// behind it.
void start_other_cores() {
    for (std::size_t i = 1; i < cores_in_computer(); ++i) {
        starting.store(&cores[i]);
        start_core(i, cores[i]);
        const Instant give_up = computer_clock.now() + 1s;
        while (starting.load() && computer_clock.now() < give_up) spin_hint();
        if (starting.exchange(nullptr)) return;
        while (core_count() == static_cast<int>(i)) spin_hint();
    }
}

void start_first_core() {
    host_core().open(first_core(), true);  // exceptions are told from here on
    set_contract_handler([](const char* condition, const char* file, int line) {
        panic(text(file, ":", line, ": contract broken: ", condition));
    });
    start_computer(facts);
    host_core().set_target(own_target());
    count_core();
}

void go_on_as_host() {
    start_other_cores();
    enable_interrupts();
    metal_main(facts.words);
}

}  // namespace
}  // namespace qduino::board::metal

void boot_main(std::uint64_t magic, std::uint64_t told_at) {
    using namespace qduino::board::metal;
    const auto heap = reinterpret_cast<std::uint64_t>(image_end);  // the RAM behind the image
    if (!read_boot_facts(magic, told_at, heap, facts)) halt_forever();
    if (facts.beside) {
        linux_side.open(*facts.beside);
        begin_with_core(static_cast<int>(facts.beside->core));
    }
    if (facts.ram_end != 0) set_heap(heap, std::min(facts.ram_end, kMapped));
    Processor::set_thread_locals(make_thread_locals());
    std::for_each(constructors, constructors_end, [](void (*construct)()) { construct(); });
    start_first_core();
    open_devices(facts);
    go_on_at(host_stack_top(), &go_on_as_host);
}

void core_main() {
    using namespace qduino::board::metal;
    Core* const core = starting.exchange(nullptr);
    if (!core) halt_forever();
    join_computer();
    core->open(core_count(), false);
    core->set_target(own_target());
    count_core();
    for (;;) wait_for_interrupt();
}
