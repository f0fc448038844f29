// What is to happen at a place in the motion: the fan turns on here, this byte of the job is done
// there.
//
// Loop 1 reads a command seconds before loop 2 has played the moves in front of it. So loop 1 puts
// the action into this queue and lets its number travel with the moves:
//
//   loop 1   append(action) ─► its number ─► a marker in the planner ─► the step ring
//   loop 2   plays up to the marker ─► publishes the number
//   loop 1   pass(number) ─► every action up to that number happens now, in order
//
// Loop 1 alone calls it. Bounded; no heap. Numbers wrap after 2^32 places, so only their
// differences are used.
#pragma once

#include <array>
#include <cstdint>

#include "base/contract.h"

namespace qduino::printer::machine {

struct PlaceAction {
    enum class Kind : std::uint8_t {
        nothing,         ///< only the job position
        hot_end_target,  ///< value: °C
        bed_target,      ///< value: °C
        fan,             ///< value: 0…1
        motors_off,      ///< value: bit mask of axes
    };
    Kind kind = Kind::nothing;
    double value = 0;
    /// Job bytes done when this place is passed; 0: not part of a job.
    std::uint64_t end_offset = 0;
    std::uint64_t line = 0;
    std::uint32_t layer = 0;  ///< that the place belongs to; 0: none
};

class PlaceQueue {
  public:
    static constexpr std::uint32_t kCapacity = 8192;

    [[nodiscard]] bool full() const { return last_ - passed_ == kCapacity; }
    [[nodiscard]] bool all_passed() const { return last_ == passed_; }
    /// The number that append() will give next.
    [[nodiscard]] std::uint32_t next_number() const { return last_ + 1; }

    /// Contract: not full.
    void append(const PlaceAction& action) {
        QDUINO_EXPECT(!full());
        ++last_;
        actions_[last_ % kCapacity] = action;
    }

    /// Hands every action up to `number` to `perform(const PlaceAction&)`, once, in order. A number
    /// that was never given (a damaged page) does nothing.
    template <typename Perform>
    void pass(std::uint32_t number, Perform&& perform) {
        if (number - passed_ > last_ - passed_) return;
        while (passed_ != number) perform(actions_[++passed_ % kCapacity]);
    }

    /// Forgets what has not been passed: the motion that it stood in is gone.
    void forget() { passed_ = last_; }

  private:
    std::uint32_t last_ = 0;    // number of the newest place
    std::uint32_t passed_ = 0;  // … of the last one passed
    std::array<PlaceAction, kCapacity> actions_{};
};

}  // namespace qduino::printer::machine
