#include "board/metal/computer/computer.h"

#include <cstring>

#include "board/metal/computer/clock.h"
#include "board/metal/computer/paging.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/driver/cmos_clock.h"
#include "board/metal/driver/firmware_tables.h"
#include "board/metal/driver/io_apic.h"
#include "board/metal/driver/pc_timers.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/panic.h"
#include "board/metal/pins.h"
#include "board/metal/pins_window.h"

extern "C" {
// x86/entry.S
extern std::uint8_t trampoline[], trampoline_end[];
extern std::uint64_t next_core_stack;
extern std::uint64_t page_directories[];
}

namespace qduino::board::metal {
namespace {

constexpr std::uint32_t kTrampoline = 0x8000;  // as x86/entry.S has it

ComputerTables tables;

void read_computer(const BootFacts& facts) {
    Result<ComputerTables> read = read_firmware_tables(facts.rsdp_at, LocalApic::number());
    if (!read) panic(read.error().message.view());
    tables = *read;
    const std::uint64_t hz = clock_rate(tables.acpi_timer);
    if (hz == 0) panic("no timer tells how fast the processor's counter is");
    LocalApic::calibrate(hz);
}

/// Bit 7 of the number stays 0: it would hold non-maskable interrupts back.
std::uint8_t read_cmos(std::uint8_t number) {
    constexpr std::uint16_t kNumber = 0x70, kValue = 0x71;
    port_write(kNumber, number & 0x7f);
    return port_read(kValue);
}

void open_line(DeviceClass kind, std::uint8_t interrupt, SerialLine& line) {
    if (!line.open()) return;
    device_interrupts.add(*interrupt_lines, kind, interrupt, line);
    line.listen();
}

/// What stands in the place of the devices: Serial and the pins lead to Linux.
void open_shared_memory(BesideArea& area) {
    console_line.lead_to(area.line);
    if (pins_window.open_at(area.pins_at)) pins.wire_to(pins_window);
}

}  // namespace

/// Where the rest of the computer is Linux's, nothing of it is touched: no firmware's table, no
/// other controller, no timer but the core's own.
void start_computer(const BootFacts& facts) {
    BesideArea* const beside = facts.beside;
    if (beside)
        forbid_guard_pages(beside->tables.directories.front().data(), beside->image_offset);
    else
        forbid_guard_pages(page_directories, 0);
    if (!beside) silence_old_pic();
    LocalApic::enable(tables.local_apic, !beside);
    if (beside) {
        tables.cores.push_back(LocalApic::number());
        LocalApic::calibrate(beside->clock_hz);
    } else {
        read_computer(facts);
    }
}

void open_devices(const BootFacts& facts) {
    if (facts.beside) return open_shared_memory(*facts.beside);
    if (tables.has_cmos_clock) computer_clock.set_date(read_cmos_date(read_cmos, tables.century));
    if (tables.io_apic == 0) panic("the firmware tells of no I/O APIC");
    static IoApic io_apic(tables);
    interrupt_lines = &io_apic;
    open_line(DeviceClass::uart, Uart16550::kFirstLine, console_line);
    open_line(DeviceClass::gpio, Uart16550::kSecondLine, pins_wire);
    if (pins_window.open()) pins.wire_to(pins_window);
}

std::size_t cores_in_computer() { return tables.cores.size(); }

void start_core(std::size_t index, const Core& core) {
    std::memcpy(reinterpret_cast<void*>(kTrampoline), trampoline,
                static_cast<std::size_t>(trampoline_end - trampoline));
    next_core_stack = core.boot_stack_top();
    LocalApic::start_core(tables.cores[index], kTrampoline);
}

void join_computer() { LocalApic::enable(tables.local_apic, true); }
std::uint32_t own_target() { return LocalApic::number(); }

/// QEMU ends a turn at each timer of the computer.
bool let_cores_take_turns(double turn_us) {
    repeat_pit(turn_us);
    return true;
}

/// The debug console of QEMU and Bochs.
bool tell_emulator(std::string_view words) {
    constexpr std::uint16_t kDebugConsole = 0xe9;  // it reads as its own number
    if (port_read(kDebugConsole) != kDebugConsole) return false;
    for (const char c : words) port_write(kDebugConsole, static_cast<std::uint8_t>(c));
    return true;
}

void end_computer(int status) {
    constexpr std::uint16_t kDebugExit = 0xf4, kShutdown = 0x8900;
    port_write(kDebugExit, static_cast<std::uint8_t>(status));
    for (const char c : std::string_view{"Shutdown"}) port_write(kShutdown, static_cast<std::uint8_t>(c));
    halt_forever();
}

}  // namespace qduino::board::metal
