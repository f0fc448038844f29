#include "arduino/HardwareSerial.h"

#include "arduino/core/diagnostics.h"
#include "arduino/core/host_question.h"
#include "board/board.h"

using qduino::arduino::LockGuard;
using qduino::arduino::SerialPort;

HardwareSerial Serial QDUINO_BEFORE_SKETCH{0};
HardwareSerial Serial1 QDUINO_BEFORE_SKETCH{1};
HardwareSerial Serial2 QDUINO_BEFORE_SKETCH{2};
HardwareSerial Serial3 QDUINO_BEFORE_SKETCH{3};

void HardwareSerial::begin(unsigned long baud, std::uint16_t config) {
    end();
    owned_ = qduino::arduino::default_serial_port(number_);
    open(baud, config, owned_.get());
}

void HardwareSerial::begin(unsigned long baud, std::uint16_t config, SerialPort& port) {
    end();
    open(baud, config, &port);
}

void HardwareSerial::open(unsigned long baud, std::uint16_t config, SerialPort* port) {
    if (qduino::arduino::succeeded("Serial.begin", number_, port->open(baud, config))) {
        port_ = port;
    } else {
        owned_.reset();
    }
}

void HardwareSerial::end() {
    if (port_) port_->close();
    port_ = nullptr;
    owned_.reset();
}

template <typename Answer>
int HardwareSerial::ask(Answer (SerialPort::*what)(), int otherwise) {
    const LockGuard held{lock_};
    const int answer = port_ ? static_cast<int>((port_->*what)()) : otherwise;
    if (answer == otherwise) qduino::arduino::asked_in_vain(qduino::board::DeviceClass::uart);
    return answer;
}

int HardwareSerial::available() { return ask(&SerialPort::available, 0); }
int HardwareSerial::read() {
    const int value = ask(&SerialPort::read, -1);
    if (value >= 0) qduino::board::current().device_work(qduino::board::DeviceClass::uart, 1);
    return value;
}
int HardwareSerial::peek() { return ask(&SerialPort::peek, -1); }
int HardwareSerial::availableForWrite() { return ask(&SerialPort::room, 0); }
void HardwareSerial::flush() {
    const LockGuard held{lock_};
    if (port_) port_->flush();
}

void HardwareSerial::settle(int ms) {
    if (port_) port_->flush_for(ms);
}

void HardwareSerial::hold_output(bool held) {
    if (port_) port_->hold_output(held);
}

void qduino::arduino::settle_console() { Serial.settle(1000); }
void qduino::arduino::hold_console(bool held) { Serial.hold_output(held); }

std::size_t HardwareSerial::write(const std::uint8_t* buffer, std::size_t size) {
    const LockGuard held{lock_};
    if (!port_) return 0;
    qduino::board::current().device_work(qduino::board::DeviceClass::uart, size);
    return port_->write({buffer, size});
}
