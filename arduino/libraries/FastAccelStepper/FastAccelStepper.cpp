#include "arduino/libraries/FastAccelStepper/FastAccelStepper.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "arduino/core/diagnostics.h"
#include "arduino/core/loops.h"
#include "arduino/core/releases.h"
#include "board/board.h"

namespace {

using qduino::Instant;
using qduino::kForever;
using qduino::Nanoseconds;
using qduino::arduino::LockGuard;

constexpr Nanoseconds kBudget{600'000}, kPeriod{2'000'000};
constexpr Nanoseconds kPulse{2'000};           // of a driver such as the A4988, 1 µs at least
constexpr Nanoseconds kLongestNap{1'000'000};  // after which a new order is seen
constexpr std::int64_t kEndless = std::int64_t{1} << 52;

FastAccelStepperEngine* engine_of_loop = nullptr;

Nanoseconds duration_of(double seconds) {
    constexpr double kDay = 86'400;
    return Nanoseconds{std::llround(std::min(seconds, kDay) * 1e9)};
}

}  // namespace

// ---- the engine ---------------------------------------------------------------------------------

void FastAccelStepperEngine::init(std::uint8_t) {
    if (engine_of_loop) return;
    engine_of_loop = this;
    if (qduino::arduino::enter_loop_of_setup(
            kBudget, kPeriod, [] { engine_of_loop->serve(); }, "FastAccelStepper") == 0)
        qduino::arduino::refuse("FastAccelStepperEngine.init", 0, qduino::ErrorCode::unavailable,
                                "the engine's loop is made in setup(), where not 32 loops are declared");
}

FastAccelStepper* FastAccelStepperEngine::stepperConnectToPin(std::uint8_t step_pin) {
    if (count_ == steppers_.size() || step_pin >= qduino::board::kPinCount) return nullptr;
    FastAccelStepper& stepper = steppers_[count_++];
    stepper.step_pin_ = step_pin;
    pinMode(step_pin, OUTPUT);
    return &stepper;
}

void FastAccelStepperEngine::serve() {
    auto& board = qduino::board::current();
    const Instant now = board.now();
    Instant next = now + kLongestNap;
    for (std::uint8_t i = 0; i < count_; ++i) next = std::min(next, steppers_[i].serve(now));
    board.sleep_until(next);
}

// ---- pins ---------------------------------------------------------------------------------------

void FastAccelStepper::setDirectionPin(std::uint8_t pin, bool high_counts_up, std::uint16_t delay_us) {
    direction_pin_ = pin;
    high_counts_up_ = high_counts_up;
    direction_delay_ = std::chrono::microseconds{delay_us};
    if (pin != PIN_UNDEFINED) pinMode(pin, OUTPUT);
}

void FastAccelStepper::setEnablePin(std::uint8_t pin, bool low_enables) {
    enable_pin_ = pin;
    low_enables_ = low_enables;
    if (pin == PIN_UNDEFINED) return;
    digitalWrite(pin, low_enables ? HIGH : LOW);  // first, so that it never is on for an instant
    pinMode(pin, OUTPUT);
}

void FastAccelStepper::write_enable(bool enabled) {
    enabled_ = enabled;
    if (enable_pin_ != PIN_UNDEFINED) digitalWrite(enable_pin_, enabled == low_enables_ ? LOW : HIGH);
}

bool FastAccelStepper::enableOutputs() {
    const LockGuard held(lock_);
    write_enable(true);
    return true;
}

bool FastAccelStepper::disableOutputs() {
    const LockGuard held(lock_);
    write_enable(false);
    return true;
}

// ---- speeds -------------------------------------------------------------------------------------

std::int8_t FastAccelStepper::setSpeedInMilliHz(std::uint32_t speed) {
    if (speed == 0) return -1;
    speed_ = speed / 1e3;
    return 0;
}
std::int8_t FastAccelStepper::setSpeedInHz(std::uint32_t steps_per_second) {
    if (steps_per_second == 0) return -1;
    speed_ = steps_per_second;
    return 0;
}
std::int8_t FastAccelStepper::setSpeedInUs(std::uint32_t us_of_a_step) {
    if (us_of_a_step == 0) return -1;
    speed_ = 1e6 / us_of_a_step;
    return 0;
}
std::int8_t FastAccelStepper::setAcceleration(std::int32_t acceleration) {
    if (acceleration <= 0) return -1;
    acceleration_ = static_cast<std::uint32_t>(acceleration);
    return 0;
}
std::uint32_t FastAccelStepper::getSpeedInUs() const {
    return speed_ > 0 ? static_cast<std::uint32_t>(std::lround(1e6 / speed_)) : 0;
}
std::uint32_t FastAccelStepper::getSpeedInMilliHz() const {
    return static_cast<std::uint32_t>(std::lround(speed_ * 1e3));
}

void FastAccelStepper::applySpeedAcceleration() {
    if (speed_ <= 0 || acceleration_ == 0) return;
    const LockGuard held(lock_);
    ramp_.set_speed(speed_);
    ramp_.set_acceleration(acceleration_);
}

std::int32_t FastAccelStepper::getCurrentSpeedInMilliHz() {
    const LockGuard held(lock_);
    return static_cast<std::int32_t>(std::lround(ramp_.velocity() * 1e3));
}

// ---- moves --------------------------------------------------------------------------------------

std::int8_t FastAccelStepper::begin(std::int64_t target, bool blocking) {
    if (speed_ <= 0) return MOVE_ERR_SPEED_IS_UNDEFINED;
    if (acceleration_ == 0) return MOVE_ERR_ACCELERATION_IS_UNDEFINED;
    applySpeedAcceleration();
    {
        const LockGuard held(lock_);
        if (direction_pin_ == PIN_UNDEFINED && target < done_) return MOVE_ERR_NO_DIRECTION_PIN;
        ramp_.set_target(target);
    }
    while (blocking && isRunning() && !qduino::board::current().stop_requested()) delay(1);
    return MOVE_OK;
}

std::int8_t FastAccelStepper::move(std::int32_t steps, bool blocking) {
    return begin(std::int64_t{targetPos()} + steps, blocking);
}
std::int8_t FastAccelStepper::moveTo(std::int32_t position, bool blocking) {
    return begin(position, blocking);
}
std::int8_t FastAccelStepper::runForward() { return begin(kEndless, false); }
std::int8_t FastAccelStepper::runBackward() { return begin(-kEndless, false); }

void FastAccelStepper::stopMove() {
    const LockGuard held(lock_);
    if (ramp_.acceleration() > 0) ramp_.stop();
}

void FastAccelStepper::forceStop() {
    const LockGuard held(lock_);
    waits_ = false;
    ramp_.halt();
    ramp_.set_position(done_);
    rests_since_ = qduino::board::current().now();
}

void FastAccelStepper::forceStopAndNewPosition(std::int32_t position) {
    forceStop();
    setCurrentPosition(position);
}

bool FastAccelStepper::isRunning() {
    const LockGuard held(lock_);
    return waits_ || ramp_.target() != ramp_.position();
}

std::int32_t FastAccelStepper::getCurrentPosition() {
    const LockGuard held(lock_);
    return static_cast<std::int32_t>(done_);
}

void FastAccelStepper::setCurrentPosition(std::int32_t position) {
    const LockGuard held(lock_);
    ramp_.set_position(ramp_.position() + position - done_);
    done_ = position;
}

std::int32_t FastAccelStepper::targetPos() {
    const LockGuard held(lock_);
    return static_cast<std::int32_t>(std::clamp<std::int64_t>(
        ramp_.target(), std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max()));
}

// ---- the engine's loop --------------------------------------------------------------------------

Instant FastAccelStepper::serve(Instant now) {
    const LockGuard held(lock_);
    if (!waits_) start(now);
    // At most this many behind each other, for the other motors' sake.
    for (int i = 0; waits_ && due_ <= now && i < 8; ++i) {
        pulse(direction_);
        done_ += direction_;
        waits_ = false;
        const auto step = ramp_.next();
        rests_since_ = now;
        if (!step) break;
        waits_ = true;
        direction_ = step->direction;
        due_ += duration_of(step->seconds);
    }
    if (waits_) return due_;
    if (!automatic_ || !enabled_) return kForever;
    if (now < rests_since_ + disable_delay_) return rests_since_ + disable_delay_;
    write_enable(false);
    return kForever;
}

/// From rest: the outputs first.
void FastAccelStepper::start(Instant now) {
    if (ramp_.speed() <= 0) return;
    const auto step = ramp_.next();
    if (!step) return;
    Nanoseconds wait{0};
    if (automatic_ && !enabled_) {
        write_enable(true);
        wait = enable_delay_;
    }
    waits_ = true;
    direction_ = step->direction;
    due_ = now + std::max(wait, duration_of(step->seconds));
}

void FastAccelStepper::pulse(int direction) {
    auto& board = qduino::board::current();
    const int level = (direction > 0) == high_counts_up_ ? HIGH : LOW;
    if (direction_pin_ != PIN_UNDEFINED && level != level_of_direction_) {
        level_of_direction_ = level;
        digitalWrite(direction_pin_, level);
        board.busy_until(board.now() + std::max(direction_delay_, kPulse));
    }
    digitalWrite(step_pin_, HIGH);
    board.busy_until(board.now() + kPulse);
    digitalWrite(step_pin_, LOW);
}
