#include "apps/printd/kept_heat_file.h"

#include "apps/machine_file/machine_file.h"
#include "posix/durable_file.h"

namespace qduino::printd {

bool KeptHeatFile::take(printer::link::LinkLayout* link) {
    if (link == nullptr) return false;
    const printer::link::KeptHeat kept = link->kept_heat.read();
    const std::pair asked{link->session, kept.number};
    if (kept.number == 0 || asked == taken_) return false;
    const std::string text = apps::kept_text(kept.hot_end, kept.bed);
    printer::MachineConfig any;
    taken_ = asked;
    if (!apps::apply_kept(text, path_.native(), any)) return false;
    const std::filesystem::path folder = path_.parent_path();
    return posix::write_durably(path_, text).ok() && posix::sync_to_disk(folder).ok();
}

}  // namespace qduino::printd
