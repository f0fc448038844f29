// Shared by the tests of strips: one that reads pulses as the chip does (device/ws2812_chip.h).
#pragma once

#include <memory>
#include <string>

#include "config/parts.h"
#include "tests/unit/arduino/arduino_fixture.h"

class StripTest : public ArduinoTest {
  protected:
    /// A strip of `count` on `pin`, wired to the board.
    void wire(int pin, int count) {
        qduino::apps::PartSpec spec;
        spec.chip = qduino::apps::Chip::ws2812;
        spec.data = {static_cast<std::uint16_t>(pin)};
        spec.pixels = count;
        parts_ = std::make_unique<qduino::apps::Parts>(std::vector{spec});
        board().wires = parts_.get();
    }
    void TearDown() override {
        board().wires = nullptr;
        ArduinoTest::TearDown();
    }
    std::string shown() { return parts_->report(board().now + qduino::Nanoseconds{1'000'000}); }

    std::unique_ptr<qduino::apps::Parts> parts_;
};
