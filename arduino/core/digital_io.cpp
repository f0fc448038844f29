#include "arduino/core/digital_io.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <utility>

#include "arduino/core/diagnostics.h"
#include "arduino/core/releases.h"
#include "board/board.h"

using qduino::ErrorCode;
using qduino::Nanoseconds;
using qduino::arduino::refuse;
using qduino::arduino::report_error;
using qduino::arduino::succeeded;
using qduino::board::kPinCount;
namespace board = qduino::board;

namespace {

std::atomic<int> read_bits{10};
std::atomic<int> write_bits{8};
constexpr int kNoMode = -1;

/// What the sketch has made of a pin.
struct Pin {
    std::atomic<int> mode{kNoMode};  ///< as pinMode() was told
    std::atomic<bool> pwm{false};    ///< analogWrite() drives it
    /// A write does more than to write: it ends the PWM, or switches the pull-up of an input, as on
    /// an AVR.
    std::atomic<bool> more{false};

    void set_pwm(bool on) {
        pwm.store(on, std::memory_order_relaxed);
        note_more();
    }
    void set_mode(int to) {
        mode.store(to, std::memory_order_relaxed);
        note_more();
    }
    [[nodiscard]] bool is(int other) const { return mode.load(std::memory_order_relaxed) == other; }

  private:
    void note_more() {
        const bool input = is(INPUT) || is(INPUT_PULLUP);
        more.store(input || pwm.load(std::memory_order_relaxed), std::memory_order_relaxed);
    }
};
std::array<Pin, kPinCount> pins;

Pin& state_of(int pin) { return pins[static_cast<std::size_t>(pin)]; }

bool is_pin(const char* call, int pin) {
    return (pin >= 0 && pin < kPinCount) ||
           refuse(call, pin, ErrorCode::invalid_argument, "no such pin: the board has 0 to 127");
}

constexpr board::Level level_of(int level) { return level == LOW ? board::Level::low : board::Level::high; }
constexpr board::PinId pin_id(int pin) { return board::PinId{static_cast<std::uint16_t>(pin)}; }

/// Not inlined: a write that does no more is quicker without it.
[[gnu::noinline]] void write_and_more(int pin, int level) {
    Pin& state = state_of(pin);
    if (state.pwm.load(std::memory_order_relaxed)) {
        state.set_pwm(false);
        succeeded("digitalWrite", pin, board::current().pwm_write(pin_id(pin), level == LOW ? 0.0 : 1.0));
    }
    board::current().pin_write(pin_id(pin), level_of(level));
    const bool up = level != LOW;
    if (state.is(up ? INPUT : INPUT_PULLUP)) pinMode(pin, up ? INPUT_PULLUP : INPUT);
}

using Mode = std::pair<int, board::PinMode>;
constexpr Mode kModes[] = {{INPUT, board::PinMode::input},
                           {OUTPUT, board::PinMode::output},
                           {INPUT_PULLUP, board::PinMode::input_pullup},
                           {INPUT_PULLDOWN, board::PinMode::input_pulldown},
                           {OUTPUT_OPENDRAIN, board::PinMode::output_open_drain}};

int full_scale(int bits) { return (1 << bits) - 1; }

bool is_resolution(const char* call, int bits) {
    return (bits >= 1 && bits <= 24) ||
           refuse(call, bits, ErrorCode::invalid_argument, "a resolution is 1 to 24 bits");
}

}  // namespace

void pinMode(int pin, int mode) {
    if (!is_pin("pinMode", pin)) return;
    const auto* const known = std::ranges::find(kModes, mode, &Mode::first);
    if (known == std::end(kModes)) {
        refuse("pinMode", pin, ErrorCode::invalid_argument, "unknown mode; the pin is unchanged");
        return;
    }
    if (!succeeded("pinMode", pin, board::current().pin_mode(pin_id(pin), known->second))) return;
    state_of(pin).set_mode(mode);
}

void qduino::arduino::make_output(int pin) {
    if (!is_output(pin)) pinMode(pin, OUTPUT);
}

bool qduino::arduino::is_output(int pin) { return state_of(pin).is(OUTPUT); }

void digitalWrite(int pin, int level) {
    if (!is_pin("digitalWrite", pin)) return;
    if (state_of(pin).more.load(std::memory_order_relaxed)) return write_and_more(pin, level);
    board::current().pin_write(pin_id(pin), level_of(level));
}

bool safeState(int pin, int level) {
    return is_pin("safeState", pin) &&
           succeeded("safeState", pin, board::current().safe_state(pin_id(pin), level_of(level)));
}

int digitalRead(int pin) {
    if (!is_pin("digitalRead", pin)) return LOW;
    return board::current().pin_read(pin_id(pin)) == board::Level::high ? HIGH : LOW;
}

int analogRead(int pin) {
    const int channel = pin >= A0 ? pin - A0 : pin;
    if (channel < 0 || channel >= NUM_ANALOG_INPUTS) {
        refuse("analogRead", pin, ErrorCode::invalid_argument, "no such input: there are A0 to A15");
        return 0;
    }
    const auto fraction = board::current().analog_read(pin_id(A0 + channel));
    if (!fraction.ok()) {
        report_error("analogRead", pin, fraction.error());
        return 0;
    }
    const int bits = read_bits.load(std::memory_order_relaxed);
    // One step is 1/2^bits …
    const double code = std::clamp(*fraction, 0.0, 1.0) * static_cast<double>(1 << bits);
    // … and the last is cut off.
    return std::min(static_cast<int>(code), full_scale(bits));
}

float analogReadTemp() {
    const auto celsius = board::current().chip_temperature();
    if (celsius.ok()) return static_cast<float>(*celsius);
    report_error("analogReadTemp", 0, celsius.error());
    return NAN;
}

void analogWrite(int pin, int value) {
    if (!is_pin("analogWrite", pin)) return;
    const int top = full_scale(write_bits.load(std::memory_order_relaxed));
    const double duty = static_cast<double>(std::clamp(value, 0, top)) / top;
    state_of(pin).set_pwm(true);
    succeeded("analogWrite", pin, board::current().pwm_write(pin_id(pin), duty));
}

void analogWriteFrequency(int pin, double frequency_hz) {
    if (!is_pin("analogWriteFrequency", pin)) return;
    const bool possible = frequency_hz == 0 || (frequency_hz >= 1 && frequency_hz <= 1e6);
    if (!possible) return report_error("analogWriteFrequency", pin, qduino::board::bad_pwm_period());
    const Nanoseconds period = frequency_hz == 0 ? Nanoseconds{0} : qduino::from_seconds(1.0 / frequency_hz);
    succeeded("analogWriteFrequency", pin, board::current().pwm_period(pin_id(pin), period));
}

void analogReference(int mode) {
    if (mode != DEFAULT)
        refuse("analogReference", mode, ErrorCode::unsupported,
               "the converter has one reference; readings stay relative to it");
}

void analogReadResolution(int bits) {
    if (is_resolution("analogReadResolution", bits)) read_bits.store(bits, std::memory_order_relaxed);
}

void analogWriteResolution(int bits) {
    if (is_resolution("analogWriteResolution", bits)) write_bits.store(bits, std::memory_order_relaxed);
}

void shiftOut(int data_pin, int clock_pin, int order, std::uint8_t value) {
    for (int i = 0; i < 8; ++i) {
        const int shift = order == LSBFIRST ? i : 7 - i;
        digitalWrite(data_pin, (value >> shift) & 1);
        digitalWrite(clock_pin, HIGH);
        digitalWrite(clock_pin, LOW);
    }
}

std::uint8_t shiftIn(int data_pin, int clock_pin, int order) {
    unsigned value = 0;
    for (int i = 0; i < 8; ++i) {
        const int shift = order == LSBFIRST ? i : 7 - i;
        digitalWrite(clock_pin, HIGH);
        value |= static_cast<unsigned>(digitalRead(data_pin)) << shift;
        digitalWrite(clock_pin, LOW);
    }
    return static_cast<std::uint8_t>(value);
}

namespace {

constexpr Nanoseconds kPulsePollStep{1'000};

/// Polls until the pin is (or is not) at `level`; false at `give_up`. Each look advances time, so
/// that it ends in the simulator too.
bool await_level(board::PinId pin, board::Level level, bool wanted, qduino::Instant give_up) {
    while ((board::current().pin_read(pin) == level) != wanted) {
        const qduino::Instant now = board::current().now();
        if (now >= give_up) return false;
        board::current().busy_until(now + kPulsePollStep);
    }
    return true;
}

}  // namespace

unsigned long pulseIn(int pin, int level, unsigned long timeout_us) {
    if (!is_pin("pulseIn", pin)) return 0;
    const board::Level wanted = level_of(level);
    const auto timeout =
        std::chrono::microseconds{static_cast<std::int64_t>(std::min(timeout_us, 1UL << 40))};
    const qduino::Instant give_up = board::current().now() + timeout;
    // A pulse that had begun before.
    if (!await_level(pin_id(pin), wanted, false, give_up)) return 0;
    if (!await_level(pin_id(pin), wanted, true, give_up)) return 0;
    const qduino::Instant rise = board::current().now();
    if (!await_level(pin_id(pin), wanted, false, give_up)) return 0;
    return static_cast<unsigned long>(
        std::chrono::duration_cast<std::chrono::microseconds>(board::current().now() - rise).count());
}

unsigned long pulseInLong(int pin, int level, unsigned long timeout_us) {
    return pulseIn(pin, level, timeout_us);
}
