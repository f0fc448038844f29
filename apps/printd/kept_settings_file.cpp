#include "apps/printd/kept_settings_file.h"

#include <algorithm>

#include "config/machine_file.h"
#include "posix/durable_file.h"

namespace qduino::printd {
namespace {

/// The numbers keep to their bounds. They may not: the page is shared with a process that may be
/// broken.
bool is_bounded(const printer::KeptBeds& beds) {
    if (beds.size() > printer::KeptBeds::kCapacity) return false;
    return std::ranges::all_of(beds, [](const printer::KeptBed& bed) {
        return std::ranges::all_of(bed.points, [](std::size_t n) { return n <= printer::kMeshPointsMax; });
    });
}

}  // namespace

bool KeptSettingsFile::take(printer::link::LinkLayout* link) {
    if (link == nullptr) return false;
    const printer::link::KeptHeat kept = link->kept_heat.read();
    const std::pair asked{link->session, kept.number};
    if (kept.number == 0 || asked == taken_) return false;
    const printer::KeptBeds beds = link->kept_beds.read();
    taken_ = asked;
    if (!is_bounded(beds)) return false;
    const std::string text = apps::kept_text(kept.hot_end, kept.bed, beds);
    printer::MachineConfig any;
    if (!apps::apply_kept(text, path_.native(), any)) return false;
    const std::filesystem::path folder = path_.parent_path();
    return posix::write_durably(path_, text).ok() && posix::sync_to_disk(folder).ok();
}

}  // namespace qduino::printd
