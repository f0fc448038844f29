#include "arduino/libraries/SoftwareSerial/software_serial.h"

#include <algorithm>
#include <array>

#include "arduino/core/diagnostics.h"
#include "arduino/core/digital_io.h"
#include "arduino/core/timing.h"
#include "board/board.h"

namespace {

namespace board = qduino::board;
using qduino::Instant;
using qduino::Nanoseconds;

constexpr long kSlowest = 300, kFastest = 115200;
constexpr int kDataBits = 8;
constexpr int kLooksInABit = 16;
constexpr Nanoseconds kLongestLook{20'000};
constexpr std::size_t kPortsMax = 8;

std::array<std::atomic<SoftwareSerial*>, kPortsMax> ports{};
std::atomic<SoftwareSerial*> listening{nullptr};
std::atomic<std::int64_t> look_ns{kLongestLook.count()};  // of the fastest port

bool in_setup() { return board::current().current_vcpu() == board::kNoVcpu; }

/// In setup() the caller does the loop's work; a loop gives it time.
void let_serve() {
    if (in_setup()) {
        SoftwareSerial::serve();
    } else {
        delay(1);
    }
}

void serve_in_setup(Instant until) {
    while (board::current().now() < until && !board::current().stop_requested()) SoftwareSerial::serve();
}

}  // namespace

void qduino::arduino::serve_software_serial() {
    const Instant end = board::current().now() + std::chrono::milliseconds{1};
    while (board::current().now() < end && !board::current().stop_requested()) SoftwareSerial::serve();
}

void SoftwareSerial::begin(long baud) {
    if (baud < kSlowest || baud > kFastest) {
        qduino::arduino::refuse("SoftwareSerial.begin", receive_pin_, qduino::ErrorCode::invalid_argument,
                                "300 to 115200 baud");
        return;
    }
    pinMode(transmit_pin_, OUTPUT);
    digitalWrite(transmit_pin_, inverse_ ? LOW : HIGH);
    pinMode(receive_pin_, inverse_ ? INPUT : INPUT_PULLUP);
    bit_ = Nanoseconds{1'000'000'000 / baud};
    idle_seen_ = line_is_high();  // an answer may come at once
    look_ns = std::min(look_ns.load(), bit_.count() / kLooksInABit);
    for (auto& port : ports) {
        SoftwareSerial* none = nullptr;
        if (port == this || port.compare_exchange_strong(none, this)) break;
    }
    qduino::arduino::set_setup_work(&serve_in_setup);
    listen();
}

void SoftwareSerial::end() {
    stopListening();
    for (auto& port : ports) {
        SoftwareSerial* self = this;
        port.compare_exchange_strong(self, nullptr);
    }
}

bool SoftwareSerial::listen() {
    if (isListening()) return false;
    std::uint8_t dropped;
    while (in_.try_pop(dropped)) {
    }
    listening = this;
    return true;
}

bool SoftwareSerial::isListening() const { return listening == this; }

bool SoftwareSerial::stopListening() {
    SoftwareSerial* self = this;
    return listening.compare_exchange_strong(self, nullptr);
}

int SoftwareSerial::available() {
    if (in_setup()) serve();
    return static_cast<int>(in_.size());
}

int SoftwareSerial::read() {
    if (in_setup()) serve();
    std::uint8_t value;
    return in_.try_pop(value) ? value : -1;
}

int SoftwareSerial::peek() {
    const std::uint8_t* next = in_.front();
    return next ? *next : -1;
}

std::size_t SoftwareSerial::write(std::uint8_t value) {
    if (bit_.count() == 0) {
        setWriteError();
        return 0;
    }
    while (!out_.try_push(value)) {
        if (board::current().stop_requested()) return 0;
        let_serve();
    }
    if (in_setup()) flush();
    return 1;
}

void SoftwareSerial::flush() {
    while ((out_.size() > 0 || sending_) && !board::current().stop_requested()) let_serve();
}

bool SoftwareSerial::line_is_high() const { return (digitalRead(receive_pin_) == HIGH) != inverse_; }

void SoftwareSerial::send_at(Instant now) {
    if (sent_.left == 0) {
        std::uint8_t value = 0;
        sending_ = out_.size() > 0;  // before it is popped: flush() looks at both
        if (!out_.try_pop(value)) return;
        // From the lowest: the start bit, the data, the stop bit; then the end of the stop bit.
        sent_ = {.bits = (unsigned{value} << 1) | (1u << (kDataBits + 1)), .left = kDataBits + 3, .due = now};
    }
    if (now < sent_.due) return;
    if (--sent_.left == 0) return;
    digitalWrite(transmit_pin_, ((sent_.bits & 1) != 0) != inverse_ ? HIGH : LOW);
    sent_.bits >>= 1;
    sent_.due += bit_;
}

void SoftwareSerial::receive_at(Instant now) {
    if (received_.left > 0) {
        if (now >= received_.due) take_bit(line_is_high());
        return;
    }
    const bool high = line_is_high();
    if (high) idle_seen_ = true;
    if (high || !idle_seen_) return;
    // The edge was between the last look and this one; the first data bit's middle is 1.5 bits on.
    received_ = {.bits = 0, .left = kDataBits + 1, .due = now + bit_ + bit_ / 2};
}

void SoftwareSerial::take_bit(bool high) {
    received_.due += bit_;
    if (--received_.left > 0) {
        received_.bits |= unsigned{high} << (kDataBits - received_.left);
        return;
    }
    idle_seen_ = high;
    if (!high) return;  // no stop bit: not a byte
    if (!in_.try_push(static_cast<std::uint8_t>(received_.bits))) overflowed_ = true;
}

void SoftwareSerial::serve() {
    const Instant now = board::current().now();
    Instant next = now + Nanoseconds{look_ns.load()};
    for (auto& entry : ports) {
        SoftwareSerial* port = entry;
        if (!port) continue;
        port->send_at(now);
        if (port->isListening()) port->receive_at(now);
        if (port->sent_.left > 0) next = std::min(next, port->sent_.due);
        if (port->received_.left > 0) next = std::min(next, port->received_.due);
    }
    board::current().busy_until(std::max(next, now + Nanoseconds{100}));
}
