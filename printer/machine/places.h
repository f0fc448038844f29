// What is to happen at a place in the motion: the fan turns on here, this byte of the job is done
// there.
//
// Loop 1 reads a command seconds before loop 2 has played the moves in front of it. So loop 1 puts
// the action into this queue and lets its number travel with the moves:
//
//   loop 1   append(place) ─► its number ─► a marker in the planner ─► the step ring
//   loop 2   plays up to the marker ─► publishes the number
//   loop 1   pass(number) ─► every place up to that number happens now, in order
//
// Loop 1 alone calls it. Bounded; no heap. Numbers wrap after 2^32 places, so only their
// differences are used.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <variant>

#include "base/contract.h"
#include "base/quantity.h"
#include "printer/gcode/actions.h"
#include "printer/gcode/layer_finder.h"
#include "printer/gcode/position.h"

namespace qduino::printer::machine {

struct HeaterTarget {
    gcode::Heater heater = gcode::Heater::hot_end;
    Celsius target{};
};
struct FanDuty {
    double duty = 0;  ///< 0…1
};
struct MotorsOff {
    gcode::AxisSet axes;
};
/// std::monostate: nothing but the job's progress.
using PlaceAction = std::variant<std::monostate, HeaterTarget, FanDuty, MotorsOff>;

/// How far a job is done when a place is passed.
struct JobProgress {
    std::uint64_t end_offset = 0;  ///< bytes; 0: the place is not part of a job
    std::uint64_t line = 0;
    std::uint32_t layer = 0;  ///< 0: none
};

struct Place {
    PlaceAction action;
    JobProgress progress{};
};

class Places {
  public:
    static constexpr std::uint32_t kCapacity = 8192;

    /// The most that one command appends: a move, and the four before it (gcode/context.h).
    static constexpr std::uint32_t kPerCommand = 8;

    [[nodiscard]] bool full() const { return last_ - passed_ == kCapacity; }
    /// For whatever the next command may append.
    [[nodiscard]] bool has_room() const { return last_ - passed_ + kPerCommand <= kCapacity; }
    [[nodiscard]] bool all_passed() const { return last_ == passed_; }

    /// Motors go off at a place that has not been passed. Nothing may be read until then: a move
    /// that is read now would find its motor on, and make its steps when it is off.
    [[nodiscard]] bool motors_go_off() const { return off_at_.has_value(); }

    /// The number to mark the place with. Contract: not full.
    [[nodiscard]] std::uint32_t append(const Place& place) {
        QDUINO_EXPECT(!full());
        ++last_;
        places_[last_ % kCapacity] = place;
        if (std::holds_alternative<MotorsOff>(place.action)) off_at_ = last_;
        return last_;
    }

    /// Hands every place up to `number` to `perform(const Place&)`, once, in order. A number that
    /// was never given (a damaged page) does nothing.
    template <typename Perform>
    void pass(std::uint32_t number, Perform&& perform) {
        if (number - passed_ > last_ - passed_) return;
        while (passed_ != number) {
            if (off_at_ == ++passed_) off_at_.reset();
            perform(places_[passed_ % kCapacity]);
        }
    }

    /// Forgets what has not been passed: the motion that it stood in is gone.
    void forget() {
        passed_ = last_;
        off_at_.reset();
    }

    /// The layers of the job's lines that are read now.
    [[nodiscard]] gcode::LayerFinder& layers() { return layers_; }

  private:
    std::uint32_t last_ = 0;               // number of the newest place
    std::uint32_t passed_ = 0;             // … of the last one passed
    std::optional<std::uint32_t> off_at_;  // … of the newest to come at which motors go off
    gcode::LayerFinder layers_;
    std::array<Place, kCapacity> places_{};
};

}  // namespace qduino::printer::machine
