// Tells the print service, through the link, that its sketch is dead.
#pragma once

#include <sys/types.h>

#include <string>
#include <string_view>

namespace qduino::supervisor {

/// Marks the link at `path` as that of a dead (or hung) sketch, process `sketch`. Does nothing when
/// there is no such link, or when it belongs to another living sketch.
void mark_link_dead(const std::string& path, pid_t sketch, bool hung);

/// Writes the words for it, once: the first writer wins. At ordinary priority, after
/// mark_link_dead().
void write_death_note(const std::string& path, pid_t sketch, std::string_view text);

}  // namespace qduino::supervisor
