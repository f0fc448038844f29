// What a file asks for beside its path: to measure the bed and follow it, to put axes straight.
//
//   G29 G80 BED_MESH_CALIBRATE   M420 S Z   BED_MESH_CLEAR   BED_MESH_PROFILE   M852   SET_SKEW
//
// A measured bed is known by a number here; its heights are seen on the pins alone (probing.h).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <sstream>
#include <string>

#include "twin/line_reader.h"
#include "twin/machine.h"

namespace qduino::twin {

/// Holds for a piece of the path.
struct AskedCorrection {
    bool follows_bed = false;
    int map = 0;  ///< of the bed; 0: none
    double fade_end_mm = 0;
    std::array<double, 3> skew{};  ///< tangents: XY, XZ, YZ

    [[nodiscard]] bool active() const { return (follows_bed && map != 0) || skew != std::array<double, 3>{}; }
    friend bool operator==(const AskedCorrection&, const AskedCorrection&) = default;
};

class AskedBed {
  public:
    AskedBed() = default;
    explicit AskedBed(const Machine& machine)
        : now_{false, 0, machine.grid.fade_end_mm, machine.skew},
          has_probe_(machine.probe.pin != kNotWired) {}

    [[nodiscard]] const AskedCorrection& now() const { return now_; }
    /// How often a bed has been measured: their numbers count from 1.
    [[nodiscard]] int maps() const { return maps_; }
    [[nodiscard]] bool probes(const CommandLine& command) const {
        const bool code = command.letter == 'G' && (command.number == 29 || command.number == 80);
        return has_probe_ && (code || command.word == "BED_MESH_CALIBRATE");
    }
    /// Z is homed: the bed is elsewhere.
    void lose_place() { now_.follows_bed = false; }
    /// A bed that was measured earlier; its number. One that was in force is there at once.
    int know(const std::string& name, bool in_force) {
        profiles_[name] = ++maps_;
        if (in_force) now_.map = found_map_ = maps_;
        return maps_;
    }
    /// The bed has been measured once more; its number.
    int measured() {
        now_.map = found_map_ = ++maps_;
        now_.follows_bed = true;
        return now_.map;
    }
    /// For the job behind this one: nothing of it is left but what it has measured and saved.
    [[nodiscard]] AskedBed behind(const Machine& machine) const {
        AskedBed next = *this;
        next.now_ = {false, found_map_, machine.grid.fade_end_mm, machine.skew};
        return next;
    }

    /// Takes what `command` says of it. `unit_mm`: the unit of its lengths.
    void run(const CommandLine& command, double unit_mm) {
        if (command.letter == 'M' && command.number == 420) {
            if (command.has('S')) now_.follows_bed = command.value('S') != 0;
            if (command.has('Z')) now_.fade_end_mm = command.value('Z') * unit_mm;
        } else if (command.letter == 'M' && command.number == 852) {
            constexpr std::array<char, 4> kLetters{'S', 'I', 'J', 'K'};
            for (std::size_t i = 0; i < kLetters.size(); ++i)
                if (command.has(kLetters[i])) now_.skew[i == 0 ? 0 : i - 1] = command.value(kLetters[i]);
        } else if (command.letter == 'M' && command.number == 500) {
            // A bed that has no name is kept under this one.
            const auto is_now = [&](const auto& profile) { return profile.second == now_.map; };
            if (now_.map != 0 && std::ranges::none_of(profiles_, is_now)) profiles_["default"] = now_.map;
        } else if (command.word == "BED_MESH_CLEAR") {
            now_.follows_bed = false;
            now_.map = 0;
        } else if (command.word == "BED_MESH_PROFILE") {
            profile(command);
        } else if (command.word == "SET_SKEW") {
            skew(command);
        }
    }

  private:
    void profile(const CommandLine& command) {
        if (const auto name = command.word_value("SAVE")) profiles_[std::string{*name}] = now_.map;
        if (const auto name = command.word_value("REMOVE")) profiles_.erase(std::string{*name});
        const auto name = command.word_value("LOAD");
        if (!name) return;
        const auto saved = profiles_.find(std::string{*name});
        if (saved == profiles_.end() && *name != "default") return;
        if (saved != profiles_.end()) now_.map = saved->second;
        now_.follows_bed = true;
    }
    /// A printed parallelogram ABCD: AC² + BD² = 2 (AB² + AD²), AC² − BD² = 4 AB·AD·cos A.
    void skew(const CommandLine& command) {
        if (command.word_number("CLEAR").value_or(0) != 0) now_.skew = {};
        constexpr std::array<const char*, 3> kKeys{"XY", "XZ", "YZ"};
        for (std::size_t i = 0; i < kKeys.size(); ++i) {
            const auto lengths = command.word_value(kKeys[i]);
            if (!lengths) continue;
            std::istringstream words{std::string{*lengths}};
            double ac = 0, bd = 0, ad = 0;
            char comma = 0;
            words >> ac >> comma >> bd >> comma >> ad;
            const double ab = std::sqrt((ac * ac + bd * bd) / 2 - ad * ad);
            const double cosine = (ac * ac - bd * bd) / (4 * ab * ad);
            now_.skew[i] = std::tan(std::asin(cosine));
        }
    }

    AskedCorrection now_{};
    bool has_probe_ = false;
    int maps_ = 0;
    int found_map_ = 0;  // measured last, or in force at the start
    std::map<std::string, int> profiles_;
};

}  // namespace qduino::twin
