#include "board/metal/driver/serial_line.h"

#include <algorithm>

#include "board/metal/linux_side.h"
#include "board/metal/machine/instructions.h"
#include "board/metal/machine/tsc_clock.h"

namespace qduino::board::metal {
namespace {

// Registers, from the line's port on.
constexpr std::uint16_t kData = 0, kEnable = 1, kFifos = 2, kFormat = 3, kModem = 4, kState = 5, kScratch = 7;

constexpr std::uint8_t kDataReady = 0x01, kTransmitterEmpty = 0x20, kAllSent = 0x40;  // of kState
constexpr std::uint8_t kOnData = 0x01, kOnEmpty = 0x02;                               // of kEnable
constexpr int kFifoBytes = 16;

}  // namespace

ConsoleLine console_line;

void SerialLine::set(std::uint16_t offset, std::uint8_t value) const {
    port_write(static_cast<std::uint16_t>(port_ + offset), value);
}
std::uint8_t SerialLine::get(std::uint16_t offset) const {
    return port_read(static_cast<std::uint16_t>(port_ + offset));
}

bool SerialLine::open() {
    constexpr std::uint8_t kDivisorAccess = 0x80, k8N1 = 0x03, kFifosOn = 0xc7, kReady = 0x0b, kTest = 0x5a;
    set(kScratch, kTest);
    if (get(kScratch) != kTest) return false;
    set(kEnable, 0);
    set(kFormat, kDivisorAccess);
    set(kData, 1);  // 115,200 baud
    set(kEnable, 0);
    set(kFormat, k8N1);
    set(kFifos, kFifosOn);
    set(kModem, kReady);  // and the gate of its interrupt
    return true;
}

void SerialLine::lead_to(BesideLine& line) {
    port_ = 0;
    out_ = &line.out;
    in_ = &line.in;
}

bool SerialLine::all_sent() const { return out_->size() == 0 || linux_side.is_deaf(tsc_clock.now()); }

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
    if (taken < bytes.size() && linux_side.is_deaf(tsc_clock.now())) return bytes.size();
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
    set(kEnable, 0);
}

void SerialLine::serve() {
    while ((get(kState) & kDataReady) != 0) received(get(kData));
    std::uint8_t byte = 0;
    if ((get(kState) & kTransmitterEmpty) != 0) {
        for (int i = 0; i < kFifoBytes && out_->try_pop(byte); ++i) set(kData, byte);
    }
    {
        const SpinGuard held(lock_);
        quiet_ = false;
    }
    let_interrupt();
}

/// On what there is to wait for; unless a bottom half is on its way, which does so itself.
void SerialLine::let_interrupt() {
    if (port_ == 0) return;
    const SpinGuard held(lock_);
    if (!quiet_)
        set(kEnable, static_cast<std::uint8_t>((listens_ ? kOnData : 0) | (out_->size() > 0 ? kOnEmpty : 0)));
}

void SerialLine::send_now(std::span<const char> text) {
    const auto send = [this](std::uint8_t byte) {
        while ((get(kState) & kTransmitterEmpty) == 0) spin_hint();
        set(kData, byte);
    };
    std::uint8_t byte = 0;
    while (out_->try_pop(byte)) send(byte);
    for (const char c : text) send(static_cast<std::uint8_t>(c));
    while ((get(kState) & kAllSent) == 0) spin_hint();  // the machine may be turned off next
}

}  // namespace qduino::board::metal
