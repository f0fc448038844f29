// Where the machine is when a job begins, as far as that is known.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "twin/asked_bed.h"
#include "twin/bed_map.h"
#include "twin/gantry.h"
#include "twin/machine.h"

namespace qduino::twin {

struct InspectionStart {
    /// The coordinate that the firmware gives to the place.
    Position asked_mm{};
    /// Microsteps, as the twin counts them, at that place.
    Counts built{};
    /// Built microsteps at coordinate 0; may be fractional.
    std::array<double, kAxisCount> origin{};
    std::array<bool, kSlideCount> pressed{};  ///< switches
    AskedBed bed{};                           ///< as it is behind the job before
    std::map<int, BedMap> maps{};             ///< the beds that were measured

    /// Power-on: the firmware takes its present position as home.
    static InspectionStart at_power_on(const Machine& machine, const Counts& built,
                                       const std::array<bool, kSlideCount>& pressed) {
        InspectionStart start;
        start.built = built;
        start.asked_mm = home_of(machine);
        const Position motors = Gantry{machine}.motors_at(start.asked_mm);
        for (std::size_t axis = 0; axis < kAxisCount; ++axis)
            start.origin[axis] = static_cast<double>(built[axis]) -
                                 std::floor(motors[axis] * machine.axes[axis].steps_per_mm + 0.5);
        start.pressed = pressed;
        start.bed = AskedBed{machine};
        for (const KnownBedSpec& known : machine.known_beds)
            start.maps.insert_or_assign(start.bed.know(known.name, known.in_force), BedMap{known});
        return start;
    }
};

}  // namespace qduino::twin
