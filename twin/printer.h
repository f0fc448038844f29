// The virtual printer: a whole machine behind the pins and buses of a virtual board.
//
//   pins 2…16 ─► AxisDrive ×4 (driver, motor) ─► Gantry ─► Slide ×3 ─► on_step, … ─► observer
//                                                            │ position
//                                                            ▼
//   endstop pins ◄──────────────────────────────────────── switch
//
//   E microsteps ──► melted plastic ──► takes heat
//                                           ▼
//   heater, fan pins ──► Heater ×2 ──► thermistor ──► divider ──► Ads7828Chip ◄──► I2C
//
// It knows nothing of G-code, of the firmware, or of who drives the pins. So its record is a proof.
//
// Invariants: calls come in order of time, from one thread. A pin write costs one table look-up;
// heat is advanced only when it is read.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "board/peripherals.h"
#include "device/ads7828_chip.h"
#include "twin/axis_drive.h"
#include "twin/fault.h"
#include "twin/gantry.h"
#include "twin/heater.h"
#include "twin/machine.h"
#include "twin/observer.h"
#include "twin/slide.h"

namespace qduino::twin {

/// The machine as a person beside it sees it.
struct PrinterState {
    /// True machine coordinates; E: net filament pushed.
    std::array<double, kAxisCount> position_mm{};
    std::array<std::int64_t, kAxisCount> position_steps{};  ///< of the motors
    std::array<AxisCounters, kAxisCount> counters{};
    std::array<bool, kAxisCount> enabled{};
    std::array<bool, kSlideCount> pressed{};
    std::array<double, kHeaterCount> celsius{};  ///< at the sensor
    std::array<double, kHeaterCount> block_celsius{};
    std::array<double, kHeaterCount> heater_duty{};  ///< what the board drives
    /// For heaters whose duty is 0: since when; the epoch: never on.
    std::array<Instant, kHeaterCount> heater_off_since{};
    double fan_duty = 0;
    std::uint64_t timing_violations = 0;
    std::uint64_t conversions = 0;  ///< answered by the converter
};

class Printer final : public board::Peripherals {
  public:
    explicit Printer(const Machine& machine);

    // ---- the board's side: see board/peripherals.h ----------------------------------------------
    void pin_written(Instant now, board::PinId pin, board::Level level) override;
    void pwm_written(Instant now, board::PinId pin, double duty) override;
    [[nodiscard]] board::Level pin_level(Instant now, board::PinId pin) override;
    /// 0: the thermistors are behind the converter.
    [[nodiscard]] double analog_level(Instant, board::PinId) override { return 0.0; }
    [[nodiscard]] Result<void> i2c_transfer(Instant now, board::I2cBus bus, board::I2cAddress address,
                                            std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override;
    [[nodiscard]] Result<void> spi_transfer(Instant now, board::SpiBus bus, board::SpiSettings settings,
                                            std::span<std::uint8_t> data) override;

    // ---- the watcher's side ---------------------------------------------------------------------
    /// `observer` gets every microstep from now on; null: none does. The observer must outlive its
    /// watch.
    void observe(MotionObserver* observer) { observer_ = observer; }
    [[nodiscard]] PrinterState state(Instant now);
    /// Degrees at the sensor of heater `heater` (kHotEnd, kBed).
    [[nodiscard]] double sensor_celsius(Instant now, int heater);
    [[nodiscard]] const Machine& machine() const { return machine_; }
    [[nodiscard]] const AxisDrive& axis(int index) const { return axes_[static_cast<std::size_t>(index)]; }
    [[nodiscard]] const Slide& slide(std::size_t index) const { return slides_[index]; }
    /// The position of extra motor `which`, in the microsteps of its slide's first motor.
    [[nodiscard]] std::int64_t extra_position(std::size_t which) const {
        return extras_[which].drive.position();
    }

    /// Breaks something, at `fault.at` or, when that has passed, at once.
    void inject(const Fault& fault);
    /// Repairs everything, and forgets faults still to come.
    void clear_faults(Instant now);

  private:
    enum class Role : std::uint8_t { none, step, direction, enable, endstop, probe, heater, fan };
    struct Wire {
        Role role = Role::none;
        std::uint8_t index = 0;
    };
    /// A motor beside the first one of its slide, at an end of the slide that is its own.
    struct Extra {
        AxisDrive drive;
        Slide slide;
    };
    struct Sensor {
        std::optional<FaultKind> fault{};
        double celsius = 0;  // at that instant
        Instant since{};
    };

    void wire(std::uint16_t pin, Role role, std::size_t index);
    void add_extra(const ExtraMotorSpec& spec);
    [[nodiscard]] AxisDrive& drive_of(std::size_t motor);
    /// The axis of a switch, by the number of the switch.
    [[nodiscard]] const AxisSpec& axis_of(std::size_t index) const;
    [[nodiscard]] const Slide& slide_of(std::size_t index) const;
    [[nodiscard]] bool has_room(std::size_t motor, std::int64_t wanted) const;
    void step_pin(Instant now, std::size_t motor, bool level);
    void extra_step_pin(Instant now, std::size_t which, bool level);
    void drive(Instant now, Wire wire, double duty);
    void apply_due_faults(Instant now);
    void apply(const Fault& fault);
    [[nodiscard]] double sensor_volts(Instant now, int channel);
    [[nodiscard]] bool probe_closes(Instant now);
    [[nodiscard]] bool contact(Instant now, std::size_t index) const;

    Machine machine_;
    Gantry gantry_;
    std::array<Wire, board::kPinCount> wires_{};
    std::array<board::Level, board::kPinCount> driven_{};
    Counts motors_;  // where each stands, in microsteps
    std::array<AxisDrive, kAxisCount> axes_;
    std::array<Slide, kSlideCount> slides_;
    std::vector<Extra> extras_;
    std::array<Heater, kHeaterCount> heaters_;
    std::array<Sensor, kHeaterCount> sensors_{};
    std::array<std::optional<FaultKind>, kSlideCount> switches_{};
    device::Ads7828Chip converter_;
    bool probe_closed_ = false;
    bool bus_silent_ = false;
    struct {
        bool dead = false;
        double duty = 0;
    } fan_;
    double volume_per_step_mm3_;
    std::int64_t melted_to_ = 0;  // the furthest that the extruder has been
    std::uint64_t conversions_ = 0;
    struct {
        std::vector<Fault> pending;  // sorted, the earliest last
        Instant next = kForever;
    } faults_;
    MotionObserver* observer_ = nullptr;
};

}  // namespace qduino::twin
