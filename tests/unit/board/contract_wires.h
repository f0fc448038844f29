// What the contract suite connects to a board: a wire from an output to an input, a chip on each
// bus, a voltage; and a record of all that arrived.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "board/peripherals.h"

namespace qduino::board::contract {

inline constexpr PinId kDriver{10};   ///< an output, wired to kSensor
inline constexpr PinId kSensor{11};   ///< an input
inline constexpr PinId kLoose{12};    ///< connected to nothing
inline constexpr PinId kLamp{13};     ///< an output
inline constexpr PinId kHeater{9};    ///< a PWM output
inline constexpr PinId kVoltage{14};  ///< an analog input
inline constexpr double kVoltageLevel = 0.375;
inline constexpr I2cBus kI2c{1};
/// Answers with what was written to it, each byte complemented.
inline constexpr I2cAddress kChip{0x48};
inline constexpr I2cAddress kNobody{0x49};
inline constexpr SpiBus kSpi{0};  ///< a chip that returns each byte plus one

class ContractWires final : public Peripherals {
  public:
    struct PinWrite {
        Instant time;
        PinId pin;
        Level level = Level::low;
    };
    struct PwmWrite {
        Instant time;
        PinId pin;
        double duty = 0;
    };
    struct PwmPeriod {
        Instant time;
        PinId pin;
        Nanoseconds period{};
    };
    struct I2cTransfer {
        I2cAddress address;
        std::vector<std::uint8_t> out;
        std::size_t in = 0;
    };
    struct SpiTransfer {
        SpiSettings settings;
        std::vector<std::uint8_t> data;
    };

    /// Whether it reports edges itself or leaves it to the board to look. It reports each write to
    /// kDriver: one that changes nothing is no edge, and it is the board that has to know.
    explicit ContractWires(bool reports_edges = false) : reports_edges_(reports_edges) {}

    bool report_edges_to(PinEdgeSink& sink) override {
        if (reports_edges_) sink_ = &sink;
        return reports_edges_;
    }
    void pin_written(Instant now, PinId pin, Level level) override {
        pin_writes.push_back({now, pin, level});
        if (pin != kDriver) return;
        wire_ = level;
        if (sink_) sink_->pin_edge(now, kSensor, level);
    }
    void pwm_written(Instant now, PinId pin, double duty) override { pwm_writes.push_back({now, pin, duty}); }
    void pwm_period_set(Instant now, PinId pin, Nanoseconds period) override {
        pwm_periods.push_back({now, pin, period});
    }
    Level pin_level(Instant, PinId pin) override { return pin == kSensor ? wire_ : Level::low; }
    double analog_level(Instant, PinId pin) override { return pin == kVoltage ? kVoltageLevel : 0.0; }
    Result<void> i2c_transfer(Instant, I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                              std::span<std::uint8_t> in) override {
        i2c_transfers.push_back({address, {out.begin(), out.end()}, in.size()});
        if (bus.number != kI2c.number || address.value != kChip.value) {
            return make_error(ErrorCode::timed_out, "nobody at this address");
        }
        for (std::size_t i = 0; i < in.size(); ++i) {
            in[i] = out.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(~out[i % out.size()]);
        }
        return {};
    }
    Result<void> spi_transfer(Instant, SpiBus, SpiSettings settings, std::span<std::uint8_t> data) override {
        spi_transfers.push_back({settings, {data.begin(), data.end()}});
        for (std::uint8_t& byte : data) ++byte;
        return {};
    }

    /// Levels written to `pin`, in order.
    [[nodiscard]] std::vector<Level> levels_of(PinId pin) const {
        std::vector<Level> levels;
        for (const PinWrite& write : pin_writes) {
            if (write.pin == pin) levels.push_back(write.level);
        }
        return levels;
    }

    std::vector<PinWrite> pin_writes;
    std::vector<PwmWrite> pwm_writes;
    std::vector<PwmPeriod> pwm_periods;
    std::vector<I2cTransfer> i2c_transfers;
    std::vector<SpiTransfer> spi_transfers;

  private:
    bool reports_edges_;
    PinEdgeSink* sink_ = nullptr;
    Level wire_ = Level::low;
};

}  // namespace qduino::board::contract
