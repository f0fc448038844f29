#include "arduino/core/port_registers.h"

#include <atomic>

#include "arduino/core/digital_io.h"

namespace qduino::arduino {
namespace {

constexpr std::int8_t kNone = -1;

/// The pins of a port's bits 0 to 7.
struct Port {
    char letter;
    std::int8_t pins[8];
};

constexpr Port kPorts[] = {
    {'A', {22, 23, 24, 25, 26, 27, 28, 29}},
    {'B', {53, 52, 51, 50, 10, 11, 12, 13}},
    {'C', {37, 36, 35, 34, 33, 32, 31, 30}},
    {'D', {21, 20, 19, 18, kNone, kNone, kNone, 38}},
    {'E', {0, 1, kNone, 5, 2, 3, kNone, kNone}},
    {'F', {54, 55, 56, 57, 58, 59, 60, 61}},
    {'G', {41, 40, 39, kNone, kNone, 4, kNone, kNone}},
    {'H', {17, 16, kNone, 6, 7, 8, 9, kNone}},
    {'J', {15, 14, kNone, kNone, kNone, kNone, kNone, kNone}},
    {'K', {62, 63, 64, 65, 66, 67, 68, 69}},
    {'L', {49, 48, 47, 46, 45, 44, 43, 42}},
};

const Port* port_named(char letter) {
    for (const Port& port : kPorts) {
        if (port.letter == letter) return &port;
    }
    return nullptr;
}

/// What was last written to PORTx where the pin is an input: whether its pull-up is on.
std::atomic<std::uint8_t> pull_ups[sizeof kPorts / sizeof kPorts[0]];

std::atomic<std::uint8_t>& pull_ups_of(const Port& port) { return pull_ups[&port - kPorts]; }

void write_output(const Port& port, int pin, std::uint8_t bit, bool high) {
    if (is_output(pin)) return digitalWrite(pin, high ? HIGH : LOW);
    if (high) {
        pull_ups_of(port).fetch_or(bit);
    } else {
        pull_ups_of(port).fetch_and(static_cast<std::uint8_t>(~bit));
    }
    pinMode(pin, high ? INPUT_PULLUP : INPUT);
}

void write_direction(const Port& port, int pin, std::uint8_t bit, bool output) {
    if (is_output(pin) == output) return;
    const bool pull_up = (pull_ups_of(port).load() & bit) != 0;
    pinMode(pin, output ? OUTPUT : pull_up ? INPUT_PULLUP : INPUT);
    if (output) digitalWrite(pin, pull_up ? HIGH : LOW);  // the register's bit is the level now
}

bool read_bit(const Port& port, int pin, std::uint8_t bit, RegisterKind kind) {
    if (kind == RegisterKind::direction) return is_output(pin);
    const bool latched = kind == RegisterKind::output && !is_output(pin);
    return latched ? (pull_ups_of(port).load() & bit) != 0 : digitalRead(pin) == HIGH;
}

}  // namespace

std::uint8_t PortRegister::read() const {
    const Port* port = port_named(port_);
    unsigned value = 0;
    for (unsigned i = 0; port && i < 8; ++i) {
        const auto bit = static_cast<std::uint8_t>(1u << i);
        if (port->pins[i] != kNone && read_bit(*port, port->pins[i], bit, kind_)) value |= bit;
    }
    return static_cast<std::uint8_t>(value);
}

PortRegister& PortRegister::write(std::uint8_t mask, std::uint8_t value) {
    const Port* port = port_named(port_);
    for (unsigned i = 0; port && i < 8; ++i) {
        const auto bit = static_cast<std::uint8_t>(1u << i);
        const int pin = port->pins[i];
        if (pin == kNone || (mask & bit) == 0) continue;
        const bool set = (value & bit) != 0;
        if (kind_ == RegisterKind::output) write_output(*port, pin, bit, set);
        if (kind_ == RegisterKind::direction) write_direction(*port, pin, bit, set);
        // A one in PINx toggles (data sheet, "Toggling the pin").
        if (kind_ == RegisterKind::input && set)
            write_output(*port, pin, bit, !read_bit(*port, pin, bit, RegisterKind::output));
    }
    return *this;
}

char port_of(int pin) {
    for (const Port& port : kPorts) {
        for (const std::int8_t its_pin : port.pins) {
            if (its_pin == pin && pin != kNone) return port.letter;
        }
    }
    return 0;
}

std::uint8_t bit_of(int pin) {
    const Port* port = port_named(port_of(pin));
    for (unsigned i = 0; port && i < 8; ++i) {
        if (port->pins[i] == pin) return static_cast<std::uint8_t>(1u << i);
    }
    return 0;
}

PortRegister& port_register(char port, RegisterKind kind) {
    // One for each letter and kind; those that are no port answer 0 and do nothing.
    static PortRegister registers[][3] = {
#define QDUINO_PORT(letter)                                                                                \
    {                                                                                                      \
        {letter, RegisterKind::output}, {letter, RegisterKind::direction}, { letter, RegisterKind::input } \
    }
        QDUINO_PORT('A'), QDUINO_PORT('B'), QDUINO_PORT('C'), QDUINO_PORT('D'),
        QDUINO_PORT('E'), QDUINO_PORT('F'), QDUINO_PORT('G'), QDUINO_PORT('H'),
        QDUINO_PORT('J'), QDUINO_PORT('K'), QDUINO_PORT('L'), QDUINO_PORT('\0')};
#undef QDUINO_PORT
    const Port* known = port_named(port);
    const std::size_t row = known ? static_cast<std::size_t>(known - kPorts) : std::size(kPorts);
    return registers[row][static_cast<std::size_t>(kind)];
}

}  // namespace qduino::arduino
