// Gives a file or a socket that root has made to the owner of its folder, who is to use it.
#pragma once

#include <filesystem>

namespace qduino::posix {

/// Gives `path` to its folder's owner and group when this process is root; otherwise does nothing.
/// Gives the open `descriptor` where there is one: a folder's owner could put another file under
/// the name. A socket has none (−1): there a link is not followed. A refusal leaves the file to
/// root.
void give_to_owner_of_folder(const std::filesystem::path& path, int descriptor = -1);

}  // namespace qduino::posix
