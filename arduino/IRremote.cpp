#include "arduino/IRremote.hpp"

#include <atomic>

#include "arduino/core/diagnostics.h"
#include "board/board.h"

namespace board = qduino::board;
namespace nec = qduino::arduino::nec;
using qduino::Instant;
using qduino::Nanoseconds;

IRrecv IrReceiver QDUINO_BEFORE_SKETCH;
IRsend IrSender QDUINO_BEFORE_SKETCH;

namespace {

std::atomic<IRrecv*> receiving{&IrReceiver};  // whose handler is attached

}  // namespace

// ---- receiving ----------------------------------------------------------------------------------

void IRrecv::begin(int pin, bool, int) {
    pin_ = pin;
    pinMode(pin_, INPUT_PULLUP);
    last_ = board::current().now();
    receiving = this;
    attachInterrupt(digitalPinToInterrupt(pin_), &IRrecv::edge, CHANGE);
}

void IRrecv::end() { detachInterrupt(digitalPinToInterrupt(pin_)); }

void IRrecv::edge() {
    IRrecv& self = *receiving.load();
    const Instant now = board::current().now();
    const bool mark_ended = digitalRead(self.pin_) == HIGH;
    // What does not fit is lost: nobody reads.
    static_cast<void>(self.lengths_.try_push({.ns = (now - self.last_).count(), .mark = mark_ended}));
    self.last_ = now;
}

bool IRrecv::decode() {
    Length length{};
    while (lengths_.try_pop(length)) {
        const auto frame = decoder_.feed(length.mark, Nanoseconds{length.ns});
        if (!frame) continue;
        if (frame->is_repeat) {
            decodedIRData.flags = IRDATA_FLAGS_IS_REPEAT;
            return true;
        }
        const auto command = static_cast<std::uint8_t>(frame->raw >> 16);
        const bool is_nec = frame->raw == nec::raw_of(static_cast<std::uint16_t>(frame->raw), command);
        // An address of eight bits has its inverse behind it, as well.
        const auto low = static_cast<std::uint8_t>(frame->raw),
                   high = static_cast<std::uint8_t>(frame->raw >> 8);
        const bool is_short = low == static_cast<std::uint8_t>(~high);
        decodedIRData = {.protocol = is_nec ? NEC : UNKNOWN,
                         .address = static_cast<std::uint16_t>(is_short ? low : frame->raw & 0xFFFF),
                         .command = command,
                         .extra = 0,
                         .numberOfBits = nec::kBits,
                         .flags = IRDATA_FLAGS_EMPTY,
                         .decodedRawData = frame->raw};
        return true;
    }
    return false;
}

void IRrecv::printIRResultShort(Print* out) const {
    out->print(decodedIRData.protocol == NEC ? F("Protocol=NEC") : F("Protocol=UNKNOWN"));
    out->print(F(" Address=0x"));
    out->print(decodedIRData.address, HEX);
    out->print(F(" Command=0x"));
    out->print(decodedIRData.command, HEX);
    if ((decodedIRData.flags & IRDATA_FLAGS_IS_REPEAT) != 0) {
        out->println(F(" Repeat"));
        return;
    }
    out->print(F(" Raw-Data=0x"));
    out->print(decodedIRData.decodedRawData, HEX);
    out->print(' ');
    out->print(decodedIRData.numberOfBits);
    out->println(F(" bits LSB first"));
}

// ---- sending ------------------------------------------------------------------------------------

void IRsend::begin(int pin) {
    pin_ = pin;
    analogWriteFrequency(pin_, nec::kCarrierHz);
    analogWrite(pin_, 0);
}

void IRsend::send(Instant& at, nec::Frame frame) const {
    constexpr double kThird = 1.0 / 3;  // of the carrier's period: the usual duty of an LED
    const auto light = [this](bool on) {
        const board::PinId pin{static_cast<std::uint16_t>(pin_)};
        qduino::arduino::succeeded("IrSender", pin_, board::current().pwm_write(pin, on ? kThird : 0));
    };
    nec::encode(frame, [&](bool mark, Nanoseconds length) {
        qduino::arduino::wait_until(at);
        light(mark);
        at += length;
    });
    qduino::arduino::wait_until(at);
    light(false);
}

void IRsend::sendNEC(std::uint16_t address, std::uint16_t command, int repeats) {
    const bool is_short = address < 0x100;
    const auto sent = static_cast<std::uint16_t>(is_short ? address | (~address & 0xFF) << 8 : address);
    Instant begin = board::current().now();
    Instant at = begin;
    send(at, {.raw = nec::raw_of(sent, static_cast<std::uint8_t>(command)), .is_repeat = false});
    for (int i = 0; i < repeats; ++i) {
        begin += nec::kFramePeriod;
        at = begin;
        send(at, {.raw = 0, .is_repeat = true});
    }
}
