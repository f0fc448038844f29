#include "board/metal/boot/boot_main.h"

#include <algorithm>
#include <cstring>
#include <span>

#include "base/contract.h"
#include "base/text.h"
#include "board/metal/boot/start_info.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/core/kernel.h"
#include "board/metal/library/heap.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/machine/io_apic.h"
#include "board/metal/machine/local_apic.h"
#include "board/metal/machine/paging.h"
#include "board/metal/machine/tsc_clock.h"
#include "board/metal/panic.h"
#include "board/metal/serial_line.h"

extern "C" {
// boot/image.ld
extern void (*constructors[])();
extern void (*constructors_end[])();
extern std::uint8_t image_end[];
// boot/entry.S
extern std::uint8_t trampoline[], trampoline_end[];
extern std::uint64_t next_core_stack;

[[noreturn]] void boot_main(const qduino::board::metal::StartInfo* info);
[[noreturn]] void core_main();
}

namespace qduino::board::metal {
namespace {

constexpr std::uint64_t kMapped = std::uint64_t{1} << 32;  // boot/entry.S maps so much
constexpr std::uint32_t kTrampoline = 0x8000;              // and as boot/entry.S has it
constexpr std::uint32_t kFsBase = 0xc0000100;

Machine machine;
constinit Core* starting = nullptr;

/// The RAM behind the image, to the end of the range that the image is in.
void find_heap(const StartInfo& info) {
    const auto begin = reinterpret_cast<std::uint64_t>(image_end);
    const std::span ranges(reinterpret_cast<const MemoryRange*>(info.memory_at), info.memory_ranges);
    for (const MemoryRange& range : ranges) {
        if (range.kind == MemoryRange::kRam && range.begin <= begin && begin < range.begin + range.size)
            return set_heap(begin, std::min(range.begin + range.size, kMapped));
    }
}

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
void start_machine(const StartInfo& info) {
    cores[0].open(0, true);  // exceptions are told from here on
    set_contract_handler([](const char* condition, const char* file, int line) {
        panic(text(file, ":", line, ": contract broken: ", condition));
    });
    forbid_guard_pages();
    silence_old_pic();
    LocalApic::enable(machine.local_apic);
    Result<Machine> read = read_firmware_tables(info.rsdp_at, LocalApic::number());
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
}

}  // namespace
}  // namespace qduino::board::metal

void boot_main(const qduino::board::metal::StartInfo* info) {
    using namespace qduino::board::metal;
    if (info->magic != StartInfo::kMagic) halt_forever();  // no PVH loader
    find_heap(*info);
    msr_write(kFsBase, make_thread_locals());
    std::for_each(constructors, constructors_end, [](void (*construct)()) { construct(); });
    start_machine(*info);
    open_devices();
    start_other_cores();
    enable_interrupts();
    const auto* const words = reinterpret_cast<const char*>(info->command_line_at);
    metal_main(words ? std::string_view{words} : std::string_view{});
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
