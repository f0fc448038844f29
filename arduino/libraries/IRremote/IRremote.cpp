#include "arduino/libraries/IRremote/IRremote.hpp"

#include <algorithm>
#include <atomic>
#include <iterator>

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

void qduino::arduino::no_infrared(const char* call) { refuse("IRremote", 0, ErrorCode::unsupported, call); }

// ---- receiving ----------------------------------------------------------------------------------

void IRrecv::begin(int pin, bool, int) {
    pin_ = pin;
    irparams.IRReceivePin = static_cast<std::uint16_t>(pin);
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

void IRrecv::keep(Length length) {
    constexpr std::int64_t kTick = MICROS_PER_TICK * 1000, kGap = RECORD_GAP_MICROS * 1000;
    if (!length.mark && length.ns >= kGap) irparams = irparams_struct{.IRReceivePin = irparams.IRReceivePin};
    irparams.OverflowFlag = irparams.rawlen == std::size(irparams.rawbuf);
    if (irparams.OverflowFlag) return;
    irparams.rawbuf[irparams.rawlen++] =
        static_cast<std::uint16_t>(std::min<std::int64_t>((length.ns + kTick / 2) / kTick, 0xFFFF));
    decodedIRData.rawlen = irparams.rawlen;
}

bool IRrecv::decode() {
    Length length{};
    while (lengths_.try_pop(length)) {
        keep(length);
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
                         .decodedRawData = frame->raw,
                         .decodedRawDataArray = {frame->raw},
                         .rawlen = irparams.rawlen,
                         .initialGapTicks = irparams.rawbuf[0]};
        return true;
    }
    return false;
}

const __FlashStringHelper* getProtocolString(decode_type_t protocol) {
    static constexpr const char* kNames[] = {"UNKNOWN",
                                             "PulseWidth",
                                             "PulseDistance",
                                             "Apple",
                                             "Denon",
                                             "JVC",
                                             "LG",
                                             "LG2",
                                             "NEC",
                                             "NEC2",
                                             "Onkyo",
                                             "Panasonic",
                                             "Kaseikyo",
                                             "Kaseikyo_Denon",
                                             "Kaseikyo_Sharp",
                                             "Kaseikyo_JVC",
                                             "Kaseikyo_Mitsubishi",
                                             "RC5",
                                             "RC6",
                                             "RC6A",
                                             "Samsung",
                                             "SamsungLG",
                                             "Samsung48",
                                             "Sharp",
                                             "Sony",
                                             "Bang&Olufsen",
                                             "BoseWave",
                                             "Lego",
                                             "MagiQuest",
                                             "Whynter",
                                             "FAST",
                                             "OpenLASIR"};
    static_assert(std::size(kNames) == OPENLASIR + 1);
    const auto index = static_cast<std::size_t>(protocol);
    return reinterpret_cast<const __FlashStringHelper*>(kNames[index < std::size(kNames) ? index : 0]);
}

void printIRResultShort(Print* out, IRData* data, bool) {
    out->print(F("Protocol="));
    out->print(getProtocolString(data->protocol));
    out->print(F(" Address=0x"));
    out->print(data->address, HEX);
    out->print(F(" Command=0x"));
    out->print(data->command, HEX);
    if ((data->flags & IRDATA_FLAGS_IS_REPEAT) != 0) {
        out->println(F(" Repeat"));
        return;
    }
    out->print(F(" Raw-Data=0x"));
    out->print(data->decodedRawData, HEX);
    out->print(' ');
    out->print(data->numberOfBits);
    out->println(F(" bits LSB first"));
}

bool IRrecv::printIRResultShort(Print* out, bool print_gap, bool) {
    ::printIRResultShort(out, &decodedIRData, print_gap);
    return !irparams.OverflowFlag;
}

void IRrecv::printIRSendUsage(Print* out) const {
    if (decodedIRData.protocol != NEC) return;
    out->print(F("Send with: IrSender.sendNEC(0x"));
    out->print(decodedIRData.address, HEX);
    out->print(F(", 0x"));
    out->print(decodedIRData.command, HEX);
    out->println(F(", <numberOfRepeats>);"));
}

// ---- sending ------------------------------------------------------------------------------------

void IRsend::begin(int pin) {
    sendPin = pin;
    analogWriteFrequency(sendPin, nec::kCarrierHz);
    analogWrite(sendPin, 0);
}

void IRsend::light(bool on) const {
    constexpr double kThird = 1.0 / 3;  // of the carrier's period: the usual duty of an LED
    const board::PinId pin{static_cast<std::uint16_t>(sendPin)};
    qduino::arduino::succeeded("IrSender", sendPin, board::current().pwm_write(pin, on ? kThird : 0));
}

void IRsend::send(Instant& at, nec::Frame frame) const {
    nec::encode(frame, [&](bool mark, Nanoseconds length) {
        qduino::arduino::wait_until(at);
        light(mark);
        at += length;
    });
    qduino::arduino::wait_until(at);
    light(false);
}

void IRsend::enableIROut(unsigned carrier_khz) {
    if (carrier_khz == 0) return qduino::arduino::no_infrared("a carrier of 0 kHz");
    periodTimeMicros = (1000 + carrier_khz / 2) / carrier_khz;
    periodOnTimeMicros = periodTimeMicros / 3;
    analogWriteFrequency(sendPin, carrier_khz * 1000.0);
}

void IRsend::mark(unsigned us) {
    light(true);
    qduino::arduino::wait_until(board::current().now() + Nanoseconds{us * std::int64_t{1000}});
}
void IRsend::space(unsigned us) {
    light(false);
    qduino::arduino::wait_until(board::current().now() + Nanoseconds{us * std::int64_t{1000}});
}

void IRsend::sendRaw(const std::uint16_t* lengths_us, std::size_t count, unsigned carrier_khz) {
    enableIROut(carrier_khz);
    Instant at = board::current().now();
    for (std::size_t i = 0; i < count; ++i) {
        light(i % 2 == 0);
        at += Nanoseconds{lengths_us[i] * std::int64_t{1000}};
        qduino::arduino::wait_until(at);
    }
    light(false);
}

void IRsend::sendRaw(const std::uint8_t* lengths_in_ticks, std::size_t count, unsigned carrier_khz) {
    enableIROut(carrier_khz);
    Instant at = board::current().now();
    for (std::size_t i = 0; i < count; ++i) {
        light(i % 2 == 0);
        at += Nanoseconds{lengths_in_ticks[i] * std::int64_t{MICROS_PER_TICK * 1000}};
        qduino::arduino::wait_until(at);
    }
    light(false);
}

void IRsend::sendNECRaw(std::uint32_t raw, int repeats) {
    Instant begin = board::current().now();
    Instant at = begin;
    send(at, {.raw = raw, .is_repeat = false});
    for (int i = 0; i < repeats; ++i) {
        begin += nec::kFramePeriod;
        at = begin;
        send(at, {.raw = 0, .is_repeat = true});
    }
}

void IRsend::sendNEC(std::uint16_t address, std::uint16_t command, int repeats) {
    const bool is_short = address < 0x100;
    const auto sent = static_cast<std::uint16_t>(is_short ? address | (~address & 0xFF) << 8 : address);
    sendNECRaw(nec::raw_of(sent, static_cast<std::uint8_t>(command)), repeats);
}

std::size_t IRsend::write(decode_type_t protocol, std::uint16_t address, std::uint16_t command, int repeats) {
    if (protocol != NEC) {
        qduino::arduino::no_infrared("write() of another protocol than NEC");
        return 0;
    }
    sendNEC(address, command, repeats);
    return 1;
}
std::size_t IRsend::write(IRData* data, int repeats) {
    return write(data->protocol, data->address, data->command, repeats);
}
