// FastAccelStepper: stepper motors that move while the sketch does something else, under the names
// of the library. (API of "FastAccelStepper" 0.30, github.com/gin66/FastAccelStepper.)
//
//   engine.init() in setup() ──► a loop of its own, 0.6 ms in every 2 ms: it sleeps to each step's
//                                instant, and makes the pulse
//
// A step is as late as the loop wakes; the next one's instant does not shift by that. The library
// for the AVR leaves steps to a timer's hardware. For a machine's motors see sketches/printer.
#pragma once

#include <array>
#include <cstdint>

#include "arduino/Arduino.h"
#include "arduino/core/lock.h"
#include "arduino/libraries/FastAccelStepper/step_ramp.h"
#include "base/time.h"

constexpr std::uint8_t PIN_UNDEFINED = 255;
constexpr std::int8_t MOVE_OK = 0, MOVE_ERR_NO_DIRECTION_PIN = -1, MOVE_ERR_SPEED_IS_UNDEFINED = -2,
                      MOVE_ERR_ACCELERATION_IS_UNDEFINED = -3;

class FastAccelStepper {
  public:
    void setDirectionPin(std::uint8_t pin, bool high_counts_up = true, std::uint16_t delay_us = 0);
    void setEnablePin(std::uint8_t pin, bool low_enables = true);
    /// Enabled while it moves.
    void setAutoEnable(bool automatic) { automatic_ = automatic; }
    /// So long passes between enabling and the first step.
    void setDelayToEnable(std::uint32_t us) { enable_delay_ = std::chrono::microseconds{us}; }
    /// So long passes between the last step and disabling.
    void setDelayToDisable(std::uint16_t ms) { disable_delay_ = std::chrono::milliseconds{ms}; }
    bool enableOutputs();
    bool disableOutputs();
    [[nodiscard]] std::uint8_t getStepPin() const { return step_pin_; }
    [[nodiscard]] std::uint8_t getDirectionPin() const { return direction_pin_; }

    // 0, or −1 where it would be no speed. A new speed goes into effect with the next move, or by
    // applySpeedAcceleration().
    std::int8_t setSpeedInUs(std::uint32_t us_of_a_step);
    std::int8_t setSpeedInHz(std::uint32_t steps_per_second);
    std::int8_t setSpeedInMilliHz(std::uint32_t speed);
    /// Steps a second squared.
    std::int8_t setAcceleration(std::int32_t acceleration);
    void applySpeedAcceleration();
    [[nodiscard]] std::uint32_t getSpeedInUs() const;
    [[nodiscard]] std::uint32_t getSpeedInMilliHz() const;
    [[nodiscard]] std::uint32_t getAcceleration() const { return acceleration_; }
    /// Signed: what it does now.
    [[nodiscard]] std::int32_t getCurrentSpeedInMilliHz();

    /// Steps from the target that it has, or to a position. `blocking`: returns when it is there.
    std::int8_t move(std::int32_t steps, bool blocking = false);
    std::int8_t moveTo(std::int32_t position, bool blocking = false);
    std::int8_t runForward();
    std::int8_t runBackward();
    /// Comes to rest by its acceleration.
    void stopMove();
    void forceStop();
    void forceStopAndNewPosition(std::int32_t position);
    [[nodiscard]] bool isRunning();
    [[nodiscard]] bool isRampGeneratorActive() { return isRunning(); }
    [[nodiscard]] std::int32_t getCurrentPosition();
    void setCurrentPosition(std::int32_t position);
    [[nodiscard]] std::int32_t targetPos();
    [[nodiscard]] std::int32_t getPositionAfterCommandsCompleted() { return getCurrentPosition(); }

  private:
    friend class FastAccelStepperEngine;

    std::int8_t begin(std::int64_t target, bool blocking);
    void write_enable(bool enabled);
    /// By the engine's loop: does what is due, and says when it wants to be called again.
    qduino::Instant serve(qduino::Instant now);
    void pulse(int direction);
    void start(qduino::Instant now);

    std::uint8_t step_pin_ = PIN_UNDEFINED;
    std::uint8_t direction_pin_ = PIN_UNDEFINED, enable_pin_ = PIN_UNDEFINED;
    bool high_counts_up_ = true, low_enables_ = true, automatic_ = false, enabled_ = false;
    qduino::Nanoseconds direction_delay_{0}, enable_delay_{0}, disable_delay_{0};
    double speed_ = 0;                // wanted, in steps a second
    std::uint32_t acceleration_ = 0;  // wanted
    int level_of_direction_ = -1;

    // It keeps what follows.
    qduino::arduino::Lock lock_{"FastAccelStepper", qduino::runtime::Unsaid::brief};
    qduino::arduino::StepRamp ramp_;
    bool waits_ = false;     // a step is on its way, at due_
    int direction_ = 1;      // of that step
    std::int64_t done_ = 0;  // steps that were made; the ramp has the one that waits, too
    qduino::Instant due_{}, rests_since_{};
};

class FastAccelStepperEngine {
  public:
    /// Makes the loop. setup() calls it.
    void init(std::uint8_t core = 255);
    /// Null: six motors have been connected, or there is no such pin.
    FastAccelStepper* stepperConnectToPin(std::uint8_t step_pin);
    /// The loop's body.
    void serve();

  private:
    std::array<FastAccelStepper, 6> steppers_;
    std::uint8_t count_ = 0;
};
