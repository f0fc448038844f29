#include "board/metal/computer/computer.h"

#include <algorithm>

#include "board/metal/aarch64/device_tree.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/paging.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/driver/pl031.h"
#include "board/metal/driver/pl061.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/panic.h"
#include "board/metal/pins.h"

extern "C" {
// aarch64/entry.S
extern std::uint64_t next_core_stack;
extern std::uint64_t page_directories[];
void start_of_core();
}

namespace qduino::board::metal {
namespace {

constinit DeviceTree tree{};
constinit bool has_debugger = false;

/// Power State Coordination Interface (Arm DEN0022), 5.1: what firmware does for a system. QEMU
/// plays the firmware.
std::uint64_t ask_firmware(std::uint32_t function, std::uint64_t first = 0, std::uint64_t second = 0) {
    register std::uint64_t x0 asm("x0") = function;
    register std::uint64_t x1 asm("x1") = first;
    register std::uint64_t x2 asm("x2") = second;
    register std::uint64_t x3 asm("x3") = 0;
    if (tree.psci_by_smc)
        asm volatile("smc #0" : "+r"(x0), "+r"(x1), "+r"(x2), "+r"(x3) : : "memory");
    else
        asm volatile("hvc #0" : "+r"(x0), "+r"(x1), "+r"(x2), "+r"(x3) : : "memory");
    return x0;
}

/// Semihosting for AArch32 and AArch64 (Arm, 2021): a debugger, or an emulator, does what the
/// program asks at this instruction. Without one it is an invalid opcode, so the loader tells of
/// it: its first word is "semihosting" then.
std::string_view without_debugger(std::string_view words) {
    constexpr std::string_view kWord = "semihosting";
    has_debugger = words.starts_with(kWord);
    if (!has_debugger) return words;
    words.remove_prefix(kWord.size());
    return words.substr(std::min(words.size(), words.find_first_not_of(' ')));
}
void ask_debugger(std::uint64_t operation, const void* argument) {
    register std::uint64_t x0 asm("x0") = operation;
    register const void* x1 asm("x1") = argument;
    asm volatile("hlt #0xf000" : "+r"(x0) : "r"(x1) : "memory");
}

void open_line(SerialLine& line, std::uint8_t interrupt) {
    if (!line.open()) return;
    device_interrupts.add(*interrupt_lines, DeviceClass::uart, interrupt, line);
    line.listen();
}

}  // namespace

bool read_boot_facts(std::uint64_t magic, std::uint64_t told_at, std::uint64_t inside, BootFacts& facts) {
    if (magic != kDeviceTreeMagic || !read_device_tree(told_at, tree)) return false;
    facts.words = without_debugger(tree.words);
    facts.ram_end = inside >= tree.ram_begin && inside < tree.ram_end ? tree.ram_end : 0;
    return facts.ram_end != 0;
}

void start_computer(const BootFacts&) {
    forbid_guard_pages(page_directories, 0);
    computer_clock.set(QDUINO_READ_SYSTEM(cntfrq_el0), clock_count());
    if (tree.gic_distributor == 0) panic("the device tree tells of no GICv2");
    Gic::open(tree.gic_distributor, tree.gic_cpu);
    Gic::enable();
}

void open_devices(const BootFacts&) {
    computer_clock.set_date(read_pl031_date(tree.clock.at));
    static GicLines lines;
    interrupt_lines = &lines;
    Pl011::place_first(tree.uart.at);
    open_line(console_line, tree.uart.line);
    if (tree.gpio.at == 0) return;
    static Pl061 chip(tree.gpio.at);
    pins.lead_to(chip);
    device_interrupts.add(lines, DeviceClass::gpio, tree.gpio.line, chip);
}

std::size_t cores_in_computer() { return tree.cores.size(); }

void start_core(std::size_t index, const Core& core) {
    constexpr std::uint32_t kCpuOn = 0xc4000003;
    next_core_stack = core.boot_stack_top();
    asm volatile("dsb ish" : : : "memory");
    ask_firmware(kCpuOn, tree.cores[index], reinterpret_cast<std::uint64_t>(&start_of_core));
}

void join_computer() { Gic::enable(); }
std::uint32_t own_target() { return Gic::number(); }

Result<void> lead_pins_to(std::string_view device) {
    return make_error(ErrorCode::invalid_argument, "pins=", device,
                      ": the pins of this computer are those of its PL061");
}
bool let_cores_take_turns(double) { return false; }

bool tell_emulator(std::string_view words) {
    constexpr std::uint64_t kWriteCharacter = 3;
    if (!has_debugger) return false;
    for (const char& c : words) ask_debugger(kWriteCharacter, &c);
    return true;
}

void end_computer(int status) {
    constexpr std::uint64_t kExit = 0x20, kApplicationExit = 0x20026;
    constexpr std::uint32_t kSystemOff = 0x84000008;
    const std::uint64_t reason[2]{kApplicationExit, static_cast<std::uint64_t>(status)};
    if (has_debugger) ask_debugger(kExit, reason);
    ask_firmware(kSystemOff);
    halt_forever();
}

}  // namespace qduino::board::metal
