#include "arduino/HardwareSerial.h"

#include "arduino/core/diagnostics.h"
#include "arduino/core/host_question.h"
#include "arduino/core/loops.h"
#include "base/text.h"
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
    lock_.declaration().use();
    if (qduino::arduino::succeeded("Serial.begin", number_, port->open(baud, config))) {
        port_ = port;
        line_.open(baud, config);
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
int HardwareSerial::ask(Answer answer, int otherwise) {
    const LockGuard held{lock_};
    const int found = port_ ? static_cast<int>(answer()) : otherwise;
    if (found == otherwise) qduino::arduino::asked_in_vain(qduino::board::DeviceClass::uart);
    return found;
}

std::size_t HardwareSerial::arrived() {
    const std::size_t offered = port_->available();
    return line_.takes_time() ? line_.arrived(offered) : offered;
}

int HardwareSerial::available() {
    return ask([this] { return arrived(); }, 0);
}
int HardwareSerial::read() {
    const int value = ask(
        [this] {
            if (!line_.takes_time()) return port_->read();
            if (arrived() == 0) return -1;
            line_.took();
            return port_->read();
        },
        -1);
    if (value >= 0) qduino::board::current().device_work(qduino::board::DeviceClass::uart, 1);
    return value;
}
int HardwareSerial::peek() {
    return ask([this] { return !line_.takes_time() || arrived() > 0 ? port_->peek() : -1; }, -1);
}
int HardwareSerial::availableForWrite() {
    return ask([this] { return line_.takes_time() ? line_.room() : port_->room(); }, 0);
}
void HardwareSerial::flush() {
    const LockGuard held{lock_};
    if (!port_) return;
    line_.drain();
    port_->flush();
}

void HardwareSerial::settle(int ms) {
    if (port_) port_->flush_for(ms);
}

void HardwareSerial::hold_output(bool held) {
    if (port_) port_->hold_output(held);
}

void qduino::arduino::settle_console(int ms) { Serial.settle(ms); }
void qduino::arduino::hold_console(bool held) { Serial.hold_output(held); }
void qduino::arduino::run_serial_event(void (*handler)()) {
    if (Serial.available() > 0) handler();
}

const char* qduino::arduino::console_lost() { return Serial.lost(); }

void HardwareSerial::describe_waits(std::string& notes) const {
    const qduino::arduino::UartLine::Waits& waits = line_.waits();
    if (waits.all <= qduino::Nanoseconds{0}) return;
    qduino::write(notes, "Serial");
    if (number_ > 0) qduino::write(notes, number_);
    qduino::write(notes, " at ", line_.baud(), " baud had no room for ",
                  qduino::Fixed{qduino::to_seconds(waits.all), 3},
                  " s: ", waits.whose == qduino::board::kNoVcpu ? "setup()" : "loop ");
    if (waits.whose != qduino::board::kNoVcpu) qduino::write(notes, waits.whose);
    qduino::write(
        notes, " waited ", qduino::Fixed{qduino::to_seconds(waits.longest) * 1e3, 1},
        " ms at once.\n  As on an AVR, 63 bytes wait for the wire, and a loop that writes more spends its "
        "budget until there is room:\n  write less, or choose a higher baud rate.\n");
}

std::string qduino::arduino::serial_waits() {
    std::string notes;
    for (const HardwareSerial* port : {&Serial, &Serial1, &Serial2, &Serial3}) port->describe_waits(notes);
    return notes;
}

std::size_t HardwareSerial::write(const std::uint8_t* buffer, std::size_t size) {
    const LockGuard held{lock_};
    if (!port_) return 0;
    qduino::board::current().device_work(qduino::board::DeviceClass::uart, size);
    line_.send(size);
    return port_->write({buffer, size});
}
