#include "apps/supervisor/link_death.h"

#include <signal.h>

#include <algorithm>

#include "apps/link/link_file.h"

namespace qduino::supervisor {
namespace {

/// The link at `path`. Nothing is mapped when it belongs to another living sketch: that link must
/// stay open. (The sketch may be a child of the started process, a script.)
apps::LinkFile link_of(const std::string& path, pid_t sketch) {
    Result<apps::LinkFile> link = apps::map_link(path);
    if (!link.ok()) return {};
    const auto owner = static_cast<pid_t>(link->get()->sketch_pid);
    if (owner != sketch && owner > 0 && ::kill(owner, 0) == 0) return {};
    return std::move(*link);
}

}  // namespace

void mark_link_dead(const std::string& path, pid_t sketch, bool hung) {
    const apps::LinkFile link = link_of(path, sketch);
    if (link) link.get()->sketch_dead.store(hung ? 2 : 1, std::memory_order_release);
}

void write_death_note(const std::string& path, pid_t sketch, std::string_view text) {
    const apps::LinkFile file = link_of(path, sketch);
    if (!file) return;
    printer::link::LinkLayout& link = *file.get();
    if (link.death_note_ready.load() != 0) return;
    const std::size_t size = std::min(text.size(), link.death_note.size() - 1);
    std::copy_n(text.begin(), size, link.death_note.begin());
    link.death_note[size] = '\0';
    link.death_note_ready.store(1, std::memory_order_release);
}

}  // namespace qduino::supervisor
