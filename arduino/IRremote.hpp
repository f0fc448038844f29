// IRremote: infrared remote controls, under the library's names (its version 3 and 4). NEC's code,
// which most kits have; others are not decoded.
//
//   receiver module ─ pin ─► attachInterrupt(CHANGE): lengths ─► ring ─► IrReceiver.decode()
//   IrSender.sendNEC() ─► PWM of 38 kHz, on and off at its instants ─► LED
//
// The handler has an I/O VCPU of its own, and the ring keeps 256 edges: three frames. A loop that
// sends sleeps between two edges.
#pragma once

#include "arduino/Arduino.h"
#include "arduino/core/nec_code.h"
#include "channel/ring_buffer.h"

#define ENABLE_LED_FEEDBACK true
#define DISABLE_LED_FEEDBACK false
#define IRDATA_FLAGS_EMPTY 0x00
#define IRDATA_FLAGS_IS_REPEAT 0x01

// As the library numbers them.
enum decode_type_t { UNKNOWN = 0, NEC = 8 };

struct IRData {
    decode_type_t protocol = UNKNOWN;
    std::uint16_t address = 0;
    std::uint16_t command = 0;
    std::uint16_t extra = 0;
    std::uint16_t numberOfBits = 0;
    std::uint8_t flags = IRDATA_FLAGS_EMPTY;
    std::uint32_t decodedRawData = 0;
};

class IRrecv {
  public:
    explicit IRrecv(int pin = 2) : pin_(pin) {}
    /// Setup-time; one object receives. The module's output is low while there is light. The LED of the board is left
    /// alone.
    void begin(int pin, bool led_feedback = false, int led_pin = 0);
    void end();
    void enableIRIn() { begin(pin_); }
    /// True when a frame has come since the last call: `decodedIRData` has it. A repeat has the
    /// address and the command of the frame before it.
    bool decode();
    void resume() {}  // it never stops receiving
    [[nodiscard]] bool available() { return decode(); }
    /// "Protocol=NEC Address=0x4 Command=0x18 Raw-Data=0xE718FB04 32 bits LSB first"
    void printIRResultShort(Print* out) const;

    IRData decodedIRData;

  private:
    struct Length {
        std::int64_t ns;
        bool mark;
    };
    static void edge();

    int pin_;
    qduino::Instant last_{};  // the handler's
    qduino::channel::RingBuffer<Length, 256> lengths_;
    qduino::arduino::nec::Decoder decoder_;
};

class IRsend {
  public:
    /// Setup-time. A pin that has PWM.
    void begin(int pin);
    /// Takes 68 ms, and 110 ms for each repeat.
    void sendNEC(std::uint16_t address, std::uint16_t command, int repeats = 0);

  private:
    void send(qduino::Instant& at, qduino::arduino::nec::Frame frame) const;

    int pin_ = 3;
};

extern IRrecv IrReceiver;
extern IRsend IrSender;
