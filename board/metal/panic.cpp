#include "board/metal/panic.h"

#include <array>
#include <atomic>

#include "base/text.h"
#include "board/metal/core/core.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/linux_side.h"
#include "board/metal/machine/instructions.h"
#include "board/metal/machine/local_apic.h"
#include "board/metal/machine/paging.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint64_t kNmi = 2, kPageFault = 14;
constinit std::atomic<bool> panicking{false};

/// Intel SDM volume 3, table 6-1.
std::string_view exception_name(std::uint64_t vector) {
    constexpr std::array<std::string_view, 20> kNames{"divide error",
                                                      "debug exception",
                                                      "non-maskable interrupt",
                                                      "breakpoint",
                                                      "overflow",
                                                      "bound exceeded",
                                                      "invalid opcode",
                                                      "no coprocessor",
                                                      "double fault",
                                                      "coprocessor overrun",
                                                      "invalid task state",
                                                      "segment not present",
                                                      "stack fault",
                                                      "general protection",
                                                      "page fault",
                                                      "reserved",
                                                      "floating-point error",
                                                      "alignment check",
                                                      "machine check",
                                                      "vector floating-point error"};
    return vector < kNames.size() ? kNames[vector] : "exception";
}

void make_safe() {
    disable_interrupts();
    if (panicking.exchange(true)) halt_forever();
    pins.force_safe_levels();
    if (!linux_side.exists()) LocalApic::stop_other_cores();
    for (int i = 0; i < 1000; ++i) spin_hint();
    pins.force_safe_levels();
}

struct Hexadecimal {
    std::uint64_t value;
};
template <typename Out>
void write_piece(Out& out, Hexadecimal number) {
    out.append("0x");
    write_characters(out, number.value, 16);
}

std::string_view kind_of_fault(std::uint64_t address) {
    if (address < 4096) return " (a null pointer)";
    return is_guard_page(address) ? " (a stack is full)" : "";
}

}  // namespace

void panic(std::string_view why) {
    make_safe();
    report(text("PANIC on core ", this_core().number(), ": ", why, '\n'));
    turn_off(1);
}

void panic(const Frame& frame) {
    if (frame.vector == kNmi && panicking.load()) halt_forever();
    make_safe();
    auto words =
        text("PANIC on core ", this_core().number(), ": ", exception_name(frame.vector), " at ",
             Hexadecimal{frame.rip}, ", stack ", Hexadecimal{frame.rsp}, ", code ", Hexadecimal{frame.error});
    if (frame.vector == kPageFault) {
        std::uint64_t address = 0;
        asm volatile("movq %%cr2, %0" : "=r"(address));
        write(words, ", touched ", Hexadecimal{address}, kind_of_fault(address));
    }
    report(write(words, '\n'));
    turn_off(1);
}

void report(std::string_view text) {
    if (linux_side.exists()) return linux_side.report(text);
    constexpr std::uint16_t kDebugConsole = 0xe9;  // it reads as its own number
    if (port_read(kDebugConsole) != kDebugConsole) return console_line.send_now(text);
    for (const char c : text) port_write(kDebugConsole, static_cast<std::uint8_t>(c));
}

void turn_off(int status) {
    constexpr std::uint16_t kDebugExit = 0xf4, kShutdown = 0x8900;
    if (linux_side.exists()) {
        linux_side.tell_end(status);
        halt_forever();
    }
    port_write(kDebugExit, static_cast<std::uint8_t>(status));
    for (const char c : std::string_view{"Shutdown"}) port_write(kShutdown, static_cast<std::uint8_t>(c));
    halt_forever();
}

}  // namespace qduino::board::metal
