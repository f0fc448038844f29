// IRremote: infrared remote controls, under the library's names (its version 3 and 4). NEC's code,
// which most kits have; others are not decoded.
//
//   receiver module ─ pin ─► attachInterrupt(CHANGE): lengths ─► ring ─► IrReceiver.decode()
//   IrSender.sendNEC() ─► PWM of 38 kHz, on and off at its instants ─► LED
//
// The handler has an I/O VCPU of its own, and the ring keeps 256 edges: three frames. A loop that
// sends sleeps between two edges. sendRaw() sends any code whose lengths the sketch has.
//
// The library's other names are here as well (version 4.7), so that a sketch compiles: what is not
// done is reported when it is called.
#pragma once

#include "arduino/Arduino.h"
#include "arduino/libraries/IRremote/infrared_numbers.h"
#include "arduino/libraries/IRremote/nec_code.h"
#include "channel/ring_buffer.h"

// The library's own header of these names finds that they are there: files of the library that a
// sketch includes by name (ac_LG.hpp) read it.
#define _IR_REMOTE_INT_H  // NOLINT: the name is the library's

#define VERSION_IRREMOTE "4.7.1"
#define VERSION_IRREMOTE_MAJOR 4
#define VERSION_IRREMOTE_MINOR 7
#define VERSION_IRREMOTE_PATCH 1
#define ENABLE_LED_FEEDBACK true
#define DISABLE_LED_FEEDBACK false
#define USE_DEFAULT_FEEDBACK_LED_PIN 0
#define IRDATA_FLAGS_EMPTY 0x00
#define IRDATA_FLAGS_IS_REPEAT 0x01
#define IRDATA_FLAGS_IS_AUTO_REPEAT 0x02
#define IRDATA_FLAGS_PARITY_FAILED 0x04
#define IRDATA_FLAGS_TOGGLE_BIT 0x08
#define IRDATA_TOGGLE_BIT_MASK 0x08
#define IRDATA_FLAGS_EXTRA_INFO 0x10
#define IRDATA_FLAGS_WAS_OVERFLOW 0x40
#define IRDATA_FLAGS_IS_LSB_FIRST 0x00
#define IRDATA_FLAGS_IS_MSB_FIRST 0x80
#define PROTOCOL_IS_LSB_FIRST false
#define PROTOCOL_IS_MSB_FIRST true
#define SEND_STOP_BIT true
#define SUPPRESS_STOP_BIT 0x20
#define NO_REPEATS 0
#define MICROS_PER_TICK 50L
#define MICROS_IN_ONE_SECOND 1000000L
#define MICROS_IN_ONE_MILLI 1000L
#define NEC_KHZ 38
#define NEC_REPEAT_DISTANCE 110000
#define SONY_KHZ 40
#define SAMSUNG_KHZ 38
#define RC5_RC6_KHZ 36
#ifndef RAW_BUFFER_LENGTH
#define RAW_BUFFER_LENGTH 200
#endif
#define DECODED_RAW_DATA_ARRAY_SIZE 8
#ifndef MARK_EXCESS_MICROS
#define MARK_EXCESS_MICROS 20
#endif
#define TOLERANCE_FOR_DECODERS_MARK_OR_SPACE_MATCHING_PERCENT 25
#ifndef RECORD_GAP_MICROS
#define RECORD_GAP_MICROS 8000
#endif
#define IR_SEND_DUTY_CYCLE_PERCENT 30
#ifndef STR
#define STR_HELPER(x) #x
#define STR(x) STR_HELPER(x)
#endif

// As the library numbers them.
enum decode_type_t {
    UNKNOWN = 0,
    PULSE_WIDTH,
    PULSE_DISTANCE,
    APPLE,
    DENON,
    JVC,
    LG,
    LG2,
    NEC,
    NEC2,
    ONKYO,
    PANASONIC,
    KASEIKYO,
    KASEIKYO_DENON,
    KASEIKYO_SHARP,
    KASEIKYO_JVC,
    KASEIKYO_MITSUBISHI,
    RC5,
    RC6,
    RC6A,
    SAMSUNG,
    SAMSUNGLG,
    SAMSUNG48,
    SHARP,
    SONY,
    BANG_OLUFSEN,
    BOSEWAVE,
    LEGO_PF,
    MAGIQUEST,
    WHYNTER,
    FAST,
    OPENLASIR
};
using IRDecodedRawDataType = std::uint32_t;
using IRRawbufType = std::uint8_t;
using IRRawlenType = std::uint16_t;

struct DistanceWidthTimingInfoStruct {
    std::uint16_t HeaderMarkMicros, HeaderSpaceMicros, OneMarkMicros, OneSpaceMicros, ZeroMarkMicros,
        ZeroSpaceMicros;
};

struct IRData {
    decode_type_t protocol = UNKNOWN;
    std::uint16_t address = 0;
    std::uint16_t command = 0;
    std::uint16_t extra = 0;
    std::uint16_t numberOfBits = 0;
    std::uint8_t flags = IRDATA_FLAGS_EMPTY;
    IRDecodedRawDataType decodedRawData = 0;
    IRDecodedRawDataType decodedRawDataArray[DECODED_RAW_DATA_ARRAY_SIZE] = {};
    DistanceWidthTimingInfoStruct DistanceWidthTimingInfo = {};
    IRRawlenType rawlen = 0;
    std::uint16_t initialGapTicks = 0;
};

/// "NEC", "Sony", … ; "UNKNOWN".
const __FlashStringHelper* getProtocolString(decode_type_t protocol);
void printIRResultShort(Print* out, IRData* data, bool print_gap = false);
inline void printIRDataShort(Print* out, IRData* data) { printIRResultShort(out, data); }

/// The first bit last.
constexpr std::uint32_t bitreverse32Bit(std::uint32_t bits) {
    std::uint32_t reversed = 0;
    for (int i = 0; i < 32; ++i) reversed |= ((bits >> i) & 1U) << (31 - i);
    return reversed;
}
/// The bit that RC5 and RC6 turn over with each key: a number that nobody reads here.
inline std::uint8_t sLastSendToggleValue = 1;

/// The lengths of a protocol's marks and spaces. Those of none are here: what takes them is
/// reported.
struct PulseDistanceWidthProtocolConstants {};
inline constexpr PulseDistanceWidthProtocolConstants NECProtocolConstants, KaseikyoProtocolConstants,
    SamsungProtocolConstants, VeluxProtocolConstants;

namespace qduino::arduino {
/// Reports that this board has no such part of IRremote.
void no_infrared(const char* call);
}  // namespace qduino::arduino
// One of the library's calls that is not done here.
#define QDUINO_NO_INFRARED(name)                   \
    template <typename... Arguments>               \
    void name(Arguments&&...) const {              \
        ::qduino::arduino::no_infrared(#name "()"); \
    }

/// The lengths of the frame that decode() found, in ticks; the first one is the pause before it.
struct irparams_struct {
    std::uint16_t IRReceivePin = 0;
    IRRawlenType rawlen = 0;
    bool OverflowFlag = false;
    std::uint16_t rawbuf[128] = {};
};

class IRrecv {
  public:
    explicit IRrecv(int pin = 2) : pin_(pin) {}
    /// Setup-time; one object receives. The module's output is low while there is light. The LED of the board is left
    /// alone.
    void begin(int pin, bool led_feedback = false, int led_pin = 0);
    void end();
    void enableIRIn() { begin(pin_); }
    void disableIRIn() { end(); }
    void start() { enableIRIn(); }
    void stop() { end(); }
    void setReceivePin(int pin) { pin_ = pin; }
    /// True when a frame has come since the last call: `decodedIRData` has it. A repeat has the
    /// address and the command of the frame before it.
    bool decode();
    void resume() {}  // it never stops receiving
    [[nodiscard]] bool available() { return decode(); }
    /// "Protocol=NEC Address=0x4 Command=0x18 Raw-Data=0xE718FB04 32 bits LSB first"
    /// False: it was longer than the record.
    bool printIRResultShort(Print* out, bool print_gap = false, bool check_recorded = true);
    void printIRResultMinimal(Print* out) { printIRResultShort(out); }
    /// "IrSender.sendNEC(0x4, 0x18, <numberOfRepeats>);"
    void printIRSendUsage(Print* out) const;
    void initDecodedIRData() { decodedIRData = {}; }
    /// Nothing is between two edges: it may be asked at any time.
    [[nodiscard]] bool isIdle() const { return true; }
    // It counts no ticks: there is nothing to stop while the sketch sends.
    void startTimer() {}
    void stopTimer() {}
    void restartTimer() {}
    void restartTimer(std::uint32_t) {}
    void restartAfterSend() {}
    /// A second receiver's, which the first one's timer calls in the library. One receives here.
    void ReceiveInterruptHandler() const { qduino::arduino::no_infrared("ReceiveInterruptHandler()"); }
    /// A number for each key of a remote whose code nobody knows: none here.
    bool decodeHash() const {
        qduino::arduino::no_infrared("decodeHash()");
        return false;
    }
    // Lengths are not kept once they are decoded.
    QDUINO_NO_INFRARED(printIRResultRawFormatted)
    QDUINO_NO_INFRARED(printIRResultAsCArray)
    QDUINO_NO_INFRARED(printIRResultAsCVariables)
    QDUINO_NO_INFRARED(printDistanceWidthTimingInfo)
    QDUINO_NO_INFRARED(compensateAndPrintIRResultAsCArray)
    QDUINO_NO_INFRARED(compensateAndPrintIRResultAsPronto)
    QDUINO_NO_INFRARED(compensateAndStoreIRResultInArray)
    QDUINO_NO_INFRARED(compensateAndStorePronto)
    QDUINO_NO_INFRARED(registerReceiveCompleteCallback)

    IRData decodedIRData;
    irparams_struct irparams;

  private:
    struct Length {
        std::int64_t ns;
        bool mark;
    };
    static void edge();
    void keep(Length length);

    int pin_;
    qduino::Instant last_{};  // the handler's
    qduino::channel::RingBuffer<Length, 256> lengths_;
    qduino::arduino::nec::Decoder decoder_;
};

class IRsend {
  public:
    /// Setup-time. A pin that has PWM.
    void begin(int pin);
    void begin(int pin, bool, int = 0) { begin(pin); }
#if defined(IR_SEND_PIN)
    void begin() { begin(int{IR_SEND_PIN}); }
    void begin(bool, int = 0) { begin(); }
#else
    void begin() { begin(sendPin); }
    void begin(bool, int = 0) { begin(); }
#endif
    void setSendPin(int pin) { begin(pin); }
    /// Takes 68 ms, and 110 ms for each repeat.
    void sendNEC(std::uint16_t address, std::uint16_t command, int repeats = 0);
    /// The 32 bits as they are sent, the lowest first.
    void sendNECRaw(std::uint32_t raw, int repeats = 0);
    /// NEC's code alone. 0: another protocol, which is reported.
    std::size_t write(IRData* data, int repeats = 0);
    std::size_t write(decode_type_t protocol, std::uint16_t address, std::uint16_t command, int repeats = 0);
    /// Light for so many µs, none for so many, and so on; in bytes, ticks of 50 µs.
    void sendRaw(const std::uint16_t* lengths_us, std::size_t count, unsigned carrier_khz);
    void sendRaw(const std::uint8_t* lengths_in_ticks, std::size_t count, unsigned carrier_khz);
    /// The same `repeats` times more, each `period_ms` after the last one began, or at once when that
    /// is over.
    template <typename Length>
    void sendRaw(const Length* lengths, std::size_t count, unsigned carrier_khz, unsigned period_ms,
                 int repeats) {
        qduino::Instant next = qduino::board::current().now();
        for (int sent = 0; sent <= repeats; ++sent) {
            qduino::arduino::wait_until(next);
            next = qduino::board::current().now() + std::chrono::milliseconds{period_ms};
            sendRaw(lengths, count, carrier_khz);
        }
    }
    template <typename Length, typename... More>
    void sendRaw_P(const Length* lengths, std::size_t count, unsigned carrier_khz, More... more) {
        sendRaw(lengths, count, carrier_khz, more...);
    }
    void enableIROut(unsigned carrier_khz);
    /// Light, or none, for so many µs; sleeps meanwhile.
    void mark(unsigned us);
    void space(unsigned us);

    int sendPin = 3;
    // The carrier's period, and how long the light is on in each.
    unsigned periodTimeMicros = 26, periodOnTimeMicros = 26 / 3;
    /// No instruction delays a pulse: the PWM makes it.
    static std::uint16_t getPulseCorrectionNanos() { return 0; }

    QDUINO_NO_INFRARED(setNextToggleBitValueForRC)
    QDUINO_NO_INFRARED(setNextToggleBitValueForRC5AndRC6)
    QDUINO_NO_INFRARED(sendRC5Marantz)
    QDUINO_NO_INFRARED(sendNECMSB)
    QDUINO_NO_INFRARED(sendOnkyo)
    QDUINO_NO_INFRARED(sendApple)
    QDUINO_NO_INFRARED(sendNEC2)
    QDUINO_NO_INFRARED(sendBangOlufsen)
    QDUINO_NO_INFRARED(sendBangOlufsenDataLink)
    QDUINO_NO_INFRARED(sendBangOlufsenRaw)
    QDUINO_NO_INFRARED(sendBoseWave)
    QDUINO_NO_INFRARED(sendDenon)
    QDUINO_NO_INFRARED(sendDenonRaw)
    QDUINO_NO_INFRARED(sendFAST)
    QDUINO_NO_INFRARED(sendJVC)
    QDUINO_NO_INFRARED(sendJVCMSB)
    QDUINO_NO_INFRARED(sendKaseikyo)
    QDUINO_NO_INFRARED(sendKaseikyo_Denon)
    QDUINO_NO_INFRARED(sendKaseikyo_JVC)
    QDUINO_NO_INFRARED(sendKaseikyo_Mitsubishi)
    QDUINO_NO_INFRARED(sendKaseikyo_Sharp)
    QDUINO_NO_INFRARED(sendLG)
    QDUINO_NO_INFRARED(sendLG2)
    QDUINO_NO_INFRARED(sendLGRaw)
    QDUINO_NO_INFRARED(sendLegoPowerFunctions)
    QDUINO_NO_INFRARED(sendMagiQuest)
    QDUINO_NO_INFRARED(sendMarantz)
    QDUINO_NO_INFRARED(sendOpenLASIR)
    /// Eight bits of the device, five of the mode, three of the data.
    static constexpr std::uint16_t computeOpenLASIRRawCommand(std::uint8_t device, std::uint8_t mode,
                                                              std::uint8_t data) {
        return static_cast<std::uint16_t>(device | (mode & 0x1f) << 8 | (data & 7) << 13);
    }
    QDUINO_NO_INFRARED(sendPanasonic)
    QDUINO_NO_INFRARED(sendPronto)
    QDUINO_NO_INFRARED(sendPronto_P)
    QDUINO_NO_INFRARED(sendPulseDistanceWidth)
    QDUINO_NO_INFRARED(sendPulseDistanceWidth_P)
    QDUINO_NO_INFRARED(sendPulseDistanceWidthFromArray)
    QDUINO_NO_INFRARED(sendPulseDistanceWidthFromArray_P)
    QDUINO_NO_INFRARED(sendPulseDistanceWidthFromPGMArray)
    QDUINO_NO_INFRARED(sendPulseDistanceWidthFromPGMArray_P)
    QDUINO_NO_INFRARED(sendRC5)
    QDUINO_NO_INFRARED(sendRC6)
    QDUINO_NO_INFRARED(sendRC6A)
    QDUINO_NO_INFRARED(sendSamsung)
    QDUINO_NO_INFRARED(sendSamsung16BitAddressAnd8BitCommand)
    QDUINO_NO_INFRARED(sendSamsung16BitAddressAndCommand)
    QDUINO_NO_INFRARED(sendSamsung48)
    QDUINO_NO_INFRARED(sendSamsungLG)
    QDUINO_NO_INFRARED(sendSamsungMSB)
    QDUINO_NO_INFRARED(sendSharp)
    QDUINO_NO_INFRARED(sendSony)
    QDUINO_NO_INFRARED(sendSonyMSB)
    QDUINO_NO_INFRARED(sendWhynter)

  private:
    void light(bool on) const;
    void send(qduino::Instant& at, qduino::arduino::nec::Frame frame) const;
};

extern IRrecv IrReceiver;
extern IRsend IrSender;

#undef QDUINO_NO_INFRARED

/// The receiver keeps no light of its own: none of these changes anything.
inline void printActiveIRProtocols(Print* out) { out->print(F("NEC/NEC2/Onkyo/Apple, ")); }
inline void disableLEDFeedback() {}
inline void enableLEDFeedback() {}
inline void setFeedbackLED(bool) {}
inline void LEDFeedbackEnableForSend(bool) {}
/// A number of 64 bits, which Print has anyway.
struct PrintULL {
    static std::size_t print(Print* out, unsigned long long value, int base = DEC) {
        return out->print(value, base);
    }
    static std::size_t println(Print* out, unsigned long long value, int base = DEC) {
        return out->println(value, base);
    }
};
