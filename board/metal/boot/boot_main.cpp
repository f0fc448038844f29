#include "board/metal/boot/boot_main.h"

#include <algorithm>
#include <cstring>

#include "base/contract.h"
#include "base/text.h"
#include "board/metal/boot/boot_facts.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/core/kernel.h"
#include "board/metal/library/heap.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/machine/io_apic.h"
#include "board/metal/machine/local_apic.h"
#include "board/metal/machine/paging.h"
#include "board/metal/machine/tsc_clock.h"
#include "board/metal/panic.h"
#include "board/metal/pins.h"
#include "board/metal/pins_window.h"
#include "board/metal/serial_line.h"

extern "C" {
// boot/image.ld
extern void (*constructors[])();
extern void (*constructors_end[])();
extern std::uint8_t image_end[];
// boot/entry.S
extern std::uint8_t trampoline[], trampoline_end[];
extern std::uint64_t next_core_stack;

[[noreturn]] void boot_main(std::uint32_t magic, std::uint64_t told_at);
[[noreturn]] void core_main();
}

namespace qduino::board::metal {
namespace {

constexpr std::uint64_t kMapped = std::uint64_t{1} << 32;  // boot/entry.S maps so much
constexpr std::uint32_t kTrampoline = 0x8000;              // and as boot/entry.S has it
constexpr std::uint32_t kFsBase = 0xc0000100;

constinit BootFacts facts{};
Machine machine;
constinit Core* starting = nullptr;

/// A core that does not come up within a tenth of a second stays out.
void start_core(Core& core, std::uint32_t apic) {
    const int before = core_count();
    starting = &core;
    next_core_stack = core.boot_stack_top();
    LocalApic::start_core(apic, kTrampoline);
    const Instant give_up = tsc_clock.now() + 100ms;
    while (core_count() == before && tsc_clock.now() < give_up) spin_hint();
}

void start_other_cores() {
    std::memcpy(reinterpret_cast<void*>(kTrampoline), trampoline,
                static_cast<std::size_t>(trampoline_end - trampoline));
    for (std::size_t i = 1; i < machine.cores.size(); ++i) {
        if (core_count() == static_cast<int>(i)) start_core(cores[i], machine.cores[i]);
    }
}

/// The first core and its controllers.
void start_machine() {
    cores[0].open(0, true);  // exceptions are told from here on
    set_contract_handler([](const char* condition, const char* file, int line) {
        panic(text(file, ":", line, ": contract broken: ", condition));
    });
    forbid_guard_pages();
    silence_old_pic();
    LocalApic::enable(machine.local_apic);
    Result<Machine> read = read_firmware_tables(facts.rsdp_at, LocalApic::number());
    if (!read) panic(read.error().message.view());
    machine = *read;
    cores[0].set_apic(LocalApic::number());
    LocalApic::calibrate();
    count_core();
}

void open_line(IoApic& io_apic, DeviceClass kind, std::uint8_t interrupt, SerialLine& line) {
    if (!line.open()) return;
    device_interrupts.add(io_apic, kind, interrupt, line);
    line.listen();
}

void open_devices() {
    if (machine.io_apic == 0) panic("the firmware tells of no I/O APIC");
    static IoApic io_apic(machine);
    open_line(io_apic, DeviceClass::uart, SerialLine::kFirstLine, console_line);
    open_line(io_apic, DeviceClass::gpio, SerialLine::kSecondLine, pins_wire);
    if (pins_window.open()) pins.wire_to(pins_window);
}

}  // namespace
}  // namespace qduino::board::metal

void boot_main(std::uint32_t magic, std::uint64_t told_at) {
    using namespace qduino::board::metal;
    const auto heap = reinterpret_cast<std::uint64_t>(image_end);  // the RAM behind the image
    if (!read_boot_facts(magic, told_at, heap, facts)) halt_forever();
    if (facts.ram_end != 0) set_heap(heap, std::min(facts.ram_end, kMapped));
    msr_write(kFsBase, make_thread_locals());
    std::for_each(constructors, constructors_end, [](void (*construct)()) { construct(); });
    start_machine();
    open_devices();
    start_other_cores();
    enable_interrupts();
    metal_main(facts.words);
}

void core_main() {
    using namespace qduino::board::metal;
    Core& core = *starting;
    LocalApic::enable(machine.local_apic);
    core.open(core_count(), false);
    core.set_apic(LocalApic::number());
    count_core();
    for (;;) asm volatile("sti\n\thlt");
}
