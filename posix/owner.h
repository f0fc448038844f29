// Who may use what root has made: a file or a socket goes to the owner of the folder that it stands in.
#pragma once

#include <filesystem>

namespace qduino::posix {

/// Gives `path` to its folder's owner and group when this process is root; nothing happens otherwise. An open `descriptor` is
/// what is given: a folder's owner could put another file under the name. A socket has no such descriptor (−1): a link in its
/// place is not followed. A refusal leaves the file to root alone.
void give_to_owner_of_folder(const std::filesystem::path& path, int descriptor = -1);

}  // namespace qduino::posix
