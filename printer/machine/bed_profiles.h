// Measured beds by name: BED_MESH_PROFILE SAVE, LOAD and REMOVE.
//
// Kept for as long as the printer runs. Bounded; loop 1 only.
#pragma once

#include <algorithm>
#include <string_view>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "base/result.h"
#include "printer/gcode/actions.h"
#include "printer/motion/correction.h"

namespace qduino::printer::machine {

class BedProfiles {
  public:
    static constexpr std::size_t kProfilesMax = 4;

    /// Error: there is no bed to save, no such profile, or no room for one more.
    [[nodiscard]] Result<void> apply(gcode::BedProfile what, std::string_view name,
                                     motion::Correction& correction) {
        const auto found = std::ranges::find_if(
            profiles_, [&](const Profile& profile) { return profile.name.view() == name; });
        const bool known = found != profiles_.end();
        if (what == gcode::BedProfile::save) {
            if (!correction.mesh().known())
                return make_error(ErrorCode::unavailable, "the bed has not been measured (G29)");
            if (known) {
                found->mesh = correction.mesh();
            } else if (!profiles_.try_push_back({FixedString<32>{name}, correction.mesh()})) {
                return make_error(ErrorCode::unavailable, "there are ", kProfilesMax,
                                  " profiles of the bed already: remove one");
            }
            return {};
        }
        if (!known) return make_error(ErrorCode::not_found, "there is no profile ", name, " of the bed");
        if (what == gcode::BedProfile::load) {
            correction.set_mesh(found->mesh);
        } else {
            profiles_.erase(static_cast<std::size_t>(found - profiles_.begin()));
        }
        return {};
    }

  private:
    struct Profile {
        FixedString<32> name{};
        motion::BedMesh mesh{};
    };
    FixedVector<Profile, kProfilesMax> profiles_;
};

}  // namespace qduino::printer::machine
