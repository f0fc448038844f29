// Measured beds by name: BED_MESH_PROFILE SAVE, LOAD and REMOVE; and M500, which keeps them.
//
//   G29 ─► the bed in force ─SAVE=a─► profiles ─M500─► the link ─► the service's file
//                          ◄─LOAD=a─          ◄──────────────────── at the next start
//
// M500 also keeps which bed is in force: the profile that is the same, whatever its name, or
// kDefaultBed, which is then made. That bed is there again after the next start: M420 S1 follows
// it, as Marlin's follows what M420 L loaded before M500. If no bed was in force, none is there.
//
// Bounded; loop 1 only.
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
    /// With those that `config` brings.
    explicit BedProfiles(const MachineConfig& config) : laid_as_(config.mesh), kept_(config.beds) {
        restore();
    }

    /// Error: there is no bed to save, no such profile, no room for one more, or a name that cannot
    /// be kept.
    [[nodiscard]] Result<void> apply(gcode::BedProfile what, std::string_view name,
                                     motion::Correction& correction) {
        if (what == gcode::BedProfile::save) return save(name, correction.mesh());
        const auto found = std::ranges::find(profiles_, name, &name_of);
        // A bed without a name: Klipper saves what it has measured at once.
        const bool is_now =
            what == gcode::BedProfile::load && name == kDefaultBed && correction.mesh().known();
        if (found == profiles_.end() && is_now) return {};
        if (found == profiles_.end())
            return make_error(ErrorCode::not_found, "there is no profile ", name, " of the bed");
        if (what == gcode::BedProfile::load) {
            correction.set_mesh(found->mesh);
        } else {
            profiles_.erase(static_cast<std::size_t>(found - profiles_.begin()));
        }
        return {};
    }

    /// What is there now is kept from now on, and `in_force` with it. Error: that had no room.
    [[nodiscard]] Result<void> keep(const motion::BedMesh& in_force) {
        Result<void> saved;
        const bool named = std::ranges::find(profiles_, in_force, &Profile::mesh) != profiles_.end();
        if (in_force.known() && !named) saved = save(kDefaultBed, in_force);
        kept_.clear();
        bool found = false;
        for (const Profile& profile : profiles_) {
            kept_.push_back(kept_of(profile));
            kept_.back().in_force = !found && in_force.known() && profile.mesh == in_force;
            found = found || kept_.back().in_force;
        }
        return saved;
    }
    /// The bed in force at the last M500 before the start; not known: there was none.
    [[nodiscard]] motion::BedMesh kept_in_force() const {
        const auto bed = std::ranges::find(kept_, true, &KeptBed::in_force);
        return bed != kept_.end() ? mesh_of(*bed) : motion::BedMesh{};
    }
    /// As of the last keep(), or of the start.
    [[nodiscard]] const KeptBeds& kept() const { return kept_; }
    /// Back to those.
    void restore() {
        profiles_.clear();
        for (const KeptBed& bed : kept_) profiles_.push_back({bed.name, mesh_of(bed)});
    }

  private:
    struct Profile {
        FixedString<32> name{};
        motion::BedMesh mesh{};
    };
    static std::string_view name_of(const Profile& profile) { return profile.name.view(); }

    [[nodiscard]] Result<void> save(std::string_view name, const motion::BedMesh& mesh) {
        if (!mesh.known()) return make_error(ErrorCode::unavailable, "the bed has not been measured (G29)");
        const auto is_plain = [](char c) {
            return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '_' ||
                   c == '-' || c == '.';
        };
        if (name.empty() || name.size() > decltype(Profile::name)::kCapacity ||
            !std::ranges::all_of(name, is_plain))
            return make_error(ErrorCode::invalid_argument,
                              "a profile's name is 1 to 32 letters, digits and _ - .");
        const auto found = std::ranges::find(profiles_, name, &name_of);
        if (found != profiles_.end()) {
            found->mesh = mesh;
        } else if (!profiles_.try_push_back({FixedString<32>{name}, mesh})) {
            return make_error(ErrorCode::unavailable, "there are ", kBedProfilesMax,
                              " profiles of the bed already: remove one");
        }
        return {};
    }
    [[nodiscard]] static KeptBed kept_of(const Profile& profile) {
        const MeshConfig& grid = profile.mesh.config();
        KeptBed bed{
            .name = profile.name, .minimum = grid.minimum, .maximum = grid.maximum, .points = grid.points};
        for (std::size_t row = 0; row < grid.points[1]; ++row)
            for (std::size_t column = 0; column < grid.points[0]; ++column)
                bed.heights[row][column] = profile.mesh.point(column, row);
        return bed;
    }
    [[nodiscard]] motion::BedMesh mesh_of(const KeptBed& bed) const {
        MeshConfig grid = laid_as_;
        grid.minimum = bed.minimum;
        grid.maximum = bed.maximum;
        grid.points = bed.points;
        motion::BedMesh mesh{grid};
        for (std::size_t row = 0; row < grid.points[1]; ++row)
            for (std::size_t column = 0; column < grid.points[0]; ++column)
                mesh.set(column, row, bed.heights[row][column]);
        return mesh;
    }

    MeshConfig laid_as_;  // of what the grid does not say
    KeptBeds kept_;
    FixedVector<Profile, kBedProfilesMax> profiles_;
};

}  // namespace qduino::printer::machine
