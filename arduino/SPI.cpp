#include "arduino/SPI.h"

#include "arduino/core/diagnostics.h"
#include "board/board.h"

namespace board = qduino::board;
using qduino::arduino::LockGuard;

SPIClass SPI QDUINO_BEFORE_SKETCH{0};
SPIClass SPI1 QDUINO_BEFORE_SKETCH{1};

void SPIClass::beginTransaction(const SPISettings& settings) {
    lock_.lock();
    settings_ = settings.get();
}

void SPIClass::setClockDivider(std::uint8_t divider) {
    constexpr std::uint32_t kUnoClockHz = 16'000'000;
    settings_.clock_hz = kUnoClockHz / (divider ? divider : 4);
}

void SPIClass::transfer(void* buffer, std::size_t size) {
    const LockGuard held{lock_};
    auto* bytes = static_cast<std::uint8_t*>(buffer);
    qduino::arduino::succeeded("SPI.transfer", bus_.number,
                               board::current().spi_transfer(bus_, settings_, {bytes, size}));
}

std::uint8_t SPIClass::transfer(std::uint8_t value) {
    const LockGuard held{lock_};
    std::uint8_t byte_in_place = value;
    const auto done = board::current().spi_transfer(bus_, settings_, {&byte_in_place, 1});
    return qduino::arduino::succeeded("SPI.transfer", bus_.number, done) ? byte_in_place : 0xff;
}

std::uint16_t SPIClass::transfer16(std::uint16_t value) {
    const LockGuard held{lock_};
    const bool low_first = settings_.least_significant_first;
    std::uint8_t bytes[2] = {static_cast<std::uint8_t>(low_first ? value : value >> 8),
                             static_cast<std::uint8_t>(low_first ? value >> 8 : value)};
    transfer(bytes, sizeof bytes);
    return static_cast<std::uint16_t>(low_first ? bytes[0] | (bytes[1] << 8) : (bytes[0] << 8) | bytes[1]);
}
