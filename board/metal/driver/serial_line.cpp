#include "board/metal/driver/serial_line.h"

#include <algorithm>

#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/linux_side.h"

namespace qduino::board::metal {
ConsoleLine console_line;

void SerialLine::lead_to(BesideLine& line) {
    uart_ = Uart{};
    out_ = &line.out;
    in_ = &line.in;
}

bool SerialLine::all_sent() const { return out_->size() == 0 || linux_side.is_deaf(computer_clock.now()); }

void SerialLine::listen() {
    listens_ = true;
    let_interrupt();
}

std::size_t SerialLine::write(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t kPiece = 64;  // so that nobody waits long, with interrupts off
    std::size_t taken = 0;
    for (bool room = true; room && taken < bytes.size();) {
        const SpinGuard held(writers_lock_);
        const auto piece = bytes.subspan(taken, std::min(kPiece, bytes.size() - taken));
        const std::size_t pushed = out_->push_some(piece);
        taken += pushed;
        room = pushed == piece.size();
    }
    if (taken < bytes.size() && linux_side.is_deaf(computer_clock.now())) return bytes.size();
    let_interrupt();
    return taken;
}

bool SerialLine::peek(std::uint8_t& byte) {
    const std::uint8_t* const next = in_->front();
    if (next) byte = *next;
    return next != nullptr;
}

void SerialLine::quiet() {
    const SpinGuard held(lock_);
    quiet_ = true;
    static_cast<void>(uart_.interrupt_on(false, false));
}

void SerialLine::serve() {
    uart_.acknowledge();
    while (uart_.has_byte()) received(uart_.take());
    std::uint8_t byte = 0;
    if (uart_.transmitter_empty()) {
        for (int i = 0; i < Uart::kFifoBytes && out_->try_pop(byte); ++i) uart_.put(byte);
    }
    {
        const SpinGuard held(lock_);
        quiet_ = false;
    }
    let_interrupt();
}

/// On what there is to wait for; unless a bottom half is on its way, which does so itself.
void SerialLine::let_interrupt() {
    if (!uart_.exists()) return;
    const SpinGuard held(lock_);
    if (!quiet_ && !uart_.interrupt_on(listens_, out_->size() > 0)) device_interrupts.ask(*this);
}

void SerialLine::send_now(std::span<const char> text) {
    const auto send = [this](std::uint8_t byte) {
        while (!uart_.transmitter_empty()) spin_hint();
        uart_.put(byte);
    };
    std::uint8_t byte = 0;
    while (out_->try_pop(byte)) send(byte);
    for (const char c : text) send(static_cast<std::uint8_t>(c));
    while (!uart_.all_sent()) spin_hint();  // the computer may be turned off next
}

}  // namespace qduino::board::metal
