#include "apps/supervisor/link_death.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>

#include "board/linux/pins_file.h"
#include "printer/link/layout.h"

namespace qduino::supervisor {
namespace {

using printer::link::LinkLayout;

/// The link at `path` when it is that of `sketch`; else not valid.
board::linux::Mapping map_link(const std::string& path, pid_t sketch) {
    const board::linux::UniqueFd fd{::open(path.c_str(), O_RDWR | O_CLOEXEC)};
    struct stat status {};
    if (!fd.valid() || ::fstat(fd.get(), &status) != 0) return {};
    if (status.st_size < static_cast<off_t>(sizeof(LinkLayout))) return {};
    auto mapping = board::linux::map_shared(fd.get(), 0, sizeof(LinkLayout), false);
    if (!mapping) return {};
    const LinkLayout& link = *mapping->as<LinkLayout>();
    if (link.magic.load(std::memory_order_acquire) != printer::link::kMagic) return {};
    if (link.version != printer::link::kVersion || link.size != sizeof(LinkLayout)) return {};
    // Another living sketch's link is not ours to close; the sketch may be a child of what we started (a script).
    const auto owner = static_cast<pid_t>(link.sketch_pid);
    if (owner != sketch && owner > 0 && ::kill(owner, 0) == 0) return {};
    return std::move(*mapping);
}

}  // namespace

void mark_link_dead(const std::string& path, pid_t sketch, bool hung) {
    const board::linux::Mapping link = map_link(path, sketch);
    if (link.valid()) link.as<LinkLayout>()->sketch_dead.store(hung ? 2 : 1, std::memory_order_release);
}

void write_death_note(const std::string& path, pid_t sketch, std::string_view text) {
    const board::linux::Mapping mapping = map_link(path, sketch);
    if (!mapping.valid()) return;
    LinkLayout& link = *mapping.as<LinkLayout>();
    if (link.death_note_ready.load() != 0) return;
    const std::size_t size = std::min(text.size(), link.death_note.size() - 1);
    std::copy_n(text.begin(), size, link.death_note.begin());
    link.death_note[size] = '\0';
    link.death_note_ready.store(1, std::memory_order_release);
}

}  // namespace qduino::supervisor
