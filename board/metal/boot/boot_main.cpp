#include "board/metal/boot/boot_main.h"

#include <algorithm>
#include <cstring>

#include "base/contract.h"
#include "base/text.h"
#include "board/metal/boot/boot_facts.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/core/kernel.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/library/heap.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/linux_side.h"
#include "board/metal/machine/io_apic.h"
#include "board/metal/machine/local_apic.h"
#include "board/metal/machine/paging.h"
#include "board/metal/machine/tsc_clock.h"
#include "board/metal/panic.h"
#include "board/metal/pins.h"
#include "board/metal/pins_window.h"

extern "C" {
// boot/image.ld
extern void (*constructors[])();
extern void (*constructors_end[])();
extern std::uint8_t image_end[];
// boot/entry.S
extern std::uint8_t trampoline[], trampoline_end[];
extern std::uint64_t next_core_stack;
extern std::uint64_t page_directories[];

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
    if (machine.cores.size() == 1) return;
    std::memcpy(reinterpret_cast<void*>(kTrampoline), trampoline,
                static_cast<std::size_t>(trampoline_end - trampoline));
    for (std::size_t i = 1; i < machine.cores.size(); ++i) {
        if (core_count() == static_cast<int>(i)) start_core(cores[i], machine.cores[i]);
    }
}

void read_machine() {
    Result<Machine> read = read_firmware_tables(facts.rsdp_at, LocalApic::number());
    if (!read) panic(read.error().message.view());
    machine = *read;
    LocalApic::calibrate();
}

/// The first core and its controllers. Where the rest of the computer is Linux's, nothing of it is
/// touched: no firmware's table, no other controller, no timer but the core's own.
void start_machine() {
    host_core().open(first_core(), true);  // exceptions are told from here on
    set_contract_handler([](const char* condition, const char* file, int line) {
        panic(text(file, ":", line, ": contract broken: ", condition));
    });
    BesideArea* const beside = facts.beside;
    if (beside)
        forbid_guard_pages(beside->tables.directories.front().data(), beside->image_offset);
    else
        forbid_guard_pages(page_directories, 0);
    if (!beside) silence_old_pic();
    LocalApic::enable(machine.local_apic, !beside);
    host_core().set_apic(LocalApic::number());
    if (beside) {
        machine.cores.push_back(LocalApic::number());
        LocalApic::calibrate_by_clock(beside->clock_hz);
    } else {
        read_machine();
    }
    count_core();
}

void open_line(IoApic& io_apic, DeviceClass kind, std::uint8_t interrupt, SerialLine& line) {
    if (!line.open()) return;
    device_interrupts.add(io_apic, kind, interrupt, line);
    line.listen();
}

/// What stands in the place of the devices: Serial and the pins lead to Linux.
void open_shared_memory(BesideArea& area) {
    console_line.lead_to(area.line);
    if (pins_window.open_at(area.pins_at)) pins.wire_to(pins_window);
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
    if (facts.beside) {
        linux_side.open(*facts.beside);
        begin_with_core(static_cast<int>(facts.beside->core));
    }
    if (facts.ram_end != 0) set_heap(heap, std::min(facts.ram_end, kMapped));
    msr_write(kFsBase, make_thread_locals());
    std::for_each(constructors, constructors_end, [](void (*construct)()) { construct(); });
    start_machine();
    facts.beside ? open_shared_memory(*facts.beside) : open_devices();
    start_other_cores();
    enable_interrupts();
    metal_main(facts.words);
}

void core_main() {
    using namespace qduino::board::metal;
    Core& core = *starting;
    LocalApic::enable(machine.local_apic, true);
    core.open(core_count(), false);
    core.set_apic(LocalApic::number());
    count_core();
    for (;;) asm volatile("sti\n\thlt");
}
