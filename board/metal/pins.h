// The pins: virtual ones, whose other ends are outside of the computer, or real ones.
//
//   pin_write ──► write_virtual_pin() (computer/instructions.h) ──► whoever listens: the witness
//   pin_read  ◄── what the wire has said ◄── one byte for each change, on the second serial line
//
//   a byte:  level ▕ p p p p p p p   the pin's number in the lower seven bits
//
// One write is one instruction, so the witness has every one, in order, of all cores. The level of
// an output is the one that was written; an input's is what came over the wire, low before that.
//
// Where something is wired to the pins that is more than a witness (wire_to(); pins_window.h), all
// goes there instead, and with it there are PWM, analog inputs and buses. Where the pins are real
// (lead_to(); driver/pin_port.h), levels go to that port, and there is nothing but levels.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "base/result.h"
#include "base/time.h"
#include "board/board.h"
#include "board/metal/driver/pin_port.h"
#include "board/metal/driver/serial_line.h"
#include "board/peripherals.h"

namespace qduino::board::metal {

class Pins {
  public:
    // As board.h has them:
    Result<void> set_mode(PinId pin, PinMode mode);
    void write(PinId pin, Level level);
    [[nodiscard]] Level read(PinId pin) const;
    Result<void> set_safe_level(PinId pin, Level level);
    Result<void> attach(PinId pin, Edge edge, EdgeHandler handler, void* context, VcpuId io);
    void detach(PinId pin);

    Result<void> write_pwm(PinId pin, double duty);
    Result<void> set_pwm_period(PinId pin, Nanoseconds period);
    [[nodiscard]] Result<double> read_analog(PinId pin) const;
    /// What is wired to the pins and the buses. Error: unsupported, where that is a witness alone.
    [[nodiscard]] Result<Peripherals*> wired() const;

    /// From now on the pins lead to `peripherals`, which is called from all cores. Before any call.
    void wire_to(Peripherals& peripherals);
    /// From now on the pins are those of `port`, and nothing is wired to them. Before any call.
    void lead_to(PinPort& port);
    /// The wire drives this level onto a pin. From the top half of its line.
    void driven(PinId pin, Level level);
    /// Drives every safe level. From anywhere, also from a panic: it takes no lock.
    void force_safe_levels();
    /// The same, and no other level is written any more. By the host.
    void hold_safe_levels();

  private:
    struct Pin {
        std::atomic<Level> written{Level::low};
        std::atomic<Level> outside{Level::low};
        std::atomic<bool> output{false};
        std::atomic<bool> pwm{false};  // the last write was a duty
        std::atomic<bool> watched{false};
        bool has_safe_level = false;
        Level safe_level = Level::low;
    };
    struct Watch {
        Edge edge = Edge::both;
        EdgeHandler handler = nullptr;
        void* context = nullptr;
        VcpuId io = kNoVcpu;
        Level last = Level::low;
    };

    /// Takes the edges that the wired peripherals report.
    class Edges final : public PinEdgeSink {
      public:
        constexpr explicit Edges(Pins& pins) : pins_(pins) {}
        void pin_edge(Instant, PinId pin, Level level) override { pins_.driven(pin, level); }

      private:
        Pins& pins_;
    };

    void put(PinId pin, Level level);
    void drive(PinId pin, Level level);
    void note_edge(PinId pin, Level level);

    [[nodiscard]] Result<void> set_real_mode(PinId pin, PinMode mode);

    PinPort* real_ = nullptr;        // null: the pins are virtual, and …
    Peripherals* wired_ = nullptr;   // … with null here there is a witness at the port
    bool edges_come_ = true;         // those of inputs
    std::atomic<bool> held_{false};  // the safe levels stay
    Edges edges_{*this};
    std::array<Pin, kPinCount> pins_{};
    std::array<Watch, kPinCount> watches_{};
};

inline constinit Pins pins;

/// The wire to the inputs: the second serial line.
class PinsWire final : public SerialLine {
  public:
    constexpr PinsWire() : SerialLine(Uart::second()) {}

  private:
    void received(std::uint8_t byte) override;
};
extern PinsWire pins_wire;

}  // namespace qduino::board::metal
