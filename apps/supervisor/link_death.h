// What the link to the print service is told of its sketch's death.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace qduino::supervisor {

/// Says in the link at `path` that its sketch, process `sketch`, is dead (or hung). Nothing happens when there is no such link or it
/// is another living sketch's.
void mark_link_dead(const std::string& path, pid_t sketch, bool hung);

/// The words for it, once: the first who writes them is heard. At ordinary priority, after mark_link_dead().
void write_death_note(const std::string& path, pid_t sketch, std::string_view text);

}  // namespace qduino::supervisor
