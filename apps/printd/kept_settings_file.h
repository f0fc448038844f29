// What M500 keeps: from the sketch's link to a file in the state folder, which the next sketch
// reads before it starts.
//
//   M500 ─► loop 1 ─four-slot─► KeptSettingsFile ─► kept-settings.toml ─► printer --kept
//
// The file is whole or it is the old one. What the link holds may be anything, so it is written
// only if it would be read: then a damaged page cannot keep the printer from starting.
#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>

#include "printer/link/layout.h"

namespace qduino::printd {

/// The file, in the state folder; apps/launcher gives the sketch the same.
inline std::filesystem::path kept_settings_path(const std::filesystem::path& state) {
    return state / "kept-settings.toml";
}

/// Some beds' heights as text take far less.
inline constexpr std::size_t kKeptSettingsBytesMax = 1 << 20;

class KeptSettingsFile {
  public:
    explicit KeptSettingsFile(const std::filesystem::path& state) : path_(kept_settings_path(state)) {}

    /// Keeps what the sketch behind `link` (may be null) has newly been told to. True: it is on
    /// file.
    bool take(printer::link::LinkLayout* link);

  private:
    std::filesystem::path path_;
    /// The last one taken, of which session.
    std::pair<std::uint64_t, std::uint32_t> taken_{};
};

}  // namespace qduino::printd
