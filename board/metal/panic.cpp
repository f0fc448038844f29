#include "board/metal/panic.h"

#include <atomic>

#include "base/text.h"
#include "board/metal/computer/computer.h"
#include "board/metal/computer/paging.h"
#include "board/metal/core/core.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/linux_side.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {
namespace {

constinit std::atomic<bool> panicking{false};

void make_safe() {
    disable_interrupts();
    if (panicking.exchange(true)) halt_forever();
    pins.force_safe_levels();
    if (!linux_side.exists()) CoreInterrupts::stop_other_cores();
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
    if (frame.vector == kStopVector && panicking.load()) halt_forever();
    make_safe();
    auto words = text("PANIC on core ", this_core().number(), ": ", exception_name(frame), " at ",
                      Hexadecimal{frame.at()}, ", stack ", Hexadecimal{frame.stack()}, ", code ",
                      Hexadecimal{frame.error});
    if (std::uint64_t address = 0; is_about_memory(frame, address))
        write(words, ", touched ", Hexadecimal{address}, kind_of_fault(address));
    report(write(words, '\n'));
    turn_off(1);
}

bool tell_beside(std::string_view text) { return linux_side.report(text) || tell_emulator(text); }

void report(std::string_view text) {
    if (!tell_beside(text)) console_line.send_now(text);
}

void turn_off(int status) {
    if (linux_side.exists()) {
        linux_side.tell_end(status);
        halt_forever();
    }
    end_computer(status);
}

}  // namespace qduino::board::metal
