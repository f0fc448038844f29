#include "arduino/core/uart_line.h"

#include <algorithm>

#include "board/board.h"

namespace qduino::arduino {
namespace {

/// Start bit, data, parity, stop bits: the SERIAL_… words of HardwareSerial.h.
std::int64_t bits_of(std::uint16_t config) {
    const int data = config >> 8 & 0xf, parity = config >> 4 & 0x3, stop = config & 0x3;
    return 1 + data + (parity != 0 ? 1 : 0) + stop;
}

}  // namespace

void UartLine::open(unsigned long baud, std::uint16_t config) {
    board::Board& board = board::current();
    const bool timed = baud > 0 && board.serial_takes_time();
    baud_ = baud;
    frame_ = Nanoseconds{timed ? bits_of(config) * 1'000'000'000 / static_cast<std::int64_t>(baud) : 0};
    sent_ = next_in_ = timed ? board.now() : kEpoch;
    idle_ = true;
    unread_ = 0;
}

void UartLine::send(std::size_t bytes) {
    if (!takes_time()) return;
    board::Board& board = board::current();
    const Instant now = board.now();
    sent_ = std::max(sent_, now) + static_cast<std::int64_t>(bytes) * frame_;
    const Instant room = sent_ - static_cast<std::int64_t>(kBuffer + kInHardware) * frame_;
    if (room <= now) return;
    const Nanoseconds wait = room - now;
    waits_.all += wait;
    if (wait > waits_.longest) {
        waits_.longest = wait;
        waits_.whose = board.current_vcpu();
    }
    board.busy_until(room);
}

std::size_t UartLine::room() const {
    const Nanoseconds left = std::max(sent_ - board::current().now(), Nanoseconds{0});
    const auto under_way = static_cast<std::size_t>((left + frame_ - Nanoseconds{1}) / frame_);
    return kBuffer - std::min(kBuffer, under_way - std::min(under_way, kInHardware));
}

void UartLine::drain() const {
    if (takes_time()) board::current().busy_until(sent_);
}

std::size_t UartLine::arrived(std::size_t offered) {
    // A loop that waits for a byte asks over and over. The clock is not asked: in the simulator
    // that is a call that takes time, and such a wait is known as a spin by the place where it
    // stands.
    if (offered == 0) {
        idle_ = true;
        return unread_ = 0;
    }
    const Instant now = board::current().now();
    if (idle_ && offered > unread_) next_in_ = std::max(next_in_, now);
    for (; unread_ < std::min(offered, kBuffer) && next_in_ <= now; next_in_ += frame_) ++unread_;
    // The other side has waited for room.
    if (unread_ == kBuffer) next_in_ = std::max(next_in_, now);
    idle_ = unread_ >= offered;
    return unread_;
}

}  // namespace qduino::arduino
