// Files in folders where another user may write too: the state folder (the service's user), the
// folders of the registers (core_lock.h). Root must not be led by them to another file.
//
// Such a user can put anything under a name: a link to /etc/shadow, a FIFO that never answers, a
// device that never ends, a second name (hard link) of a foreign file, a sparse file as large as
// the memory. So a file is used only when it is
//
//   no link      neither a symbolic one (O_NOFOLLOW) nor a hard one (one name)
//   regular      an open of anything else does not wait (O_NONBLOCK), and is given back
//   owned        by root, by this process's user, or by the one user that the caller names
//   bounded      in what is read of it
//
// and a new one is made where nothing was (O_EXCL). All checks are made on the open descriptor, so
// that nothing can be swapped in between. These functions are the only ones that may open a file in
// such a folder (tools/check_layout.py). Not real-time.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::posix {

/// No other user's files are believed.
inline constexpr uid_t kNoOtherOwner = static_cast<uid_t>(-1);

/// Opens an existing file. `access`: O_RDONLY or O_RDWR. `also`: a user whose files are
/// believed besides root's and this process's own. Errors: not_found, not_permitted (with what is
/// wrong with it), the system's.
[[nodiscard]] Result<UniqueFd> open_guarded(const std::filesystem::path& path, int access,
                                            uid_t also = kNoOtherOwner);

/// The whole text of such a file. Errors: those of open_guarded(); not_permitted when it has more
/// than `bytes_max` bytes: nothing of it is then read.
[[nodiscard]] Result<std::string> read_guarded(const std::filesystem::path& path, std::size_t bytes_max,
                                               uid_t also = kNoOtherOwner);

/// The bytes of the open file `fd`, from its beginning. Errors: not_permitted when it has more than
/// `bytes_max` (then nothing is read); the system's, with `path` as its object.
[[nodiscard]] Result<std::string> read_at_most(int fd, std::size_t bytes_max,
                                               const std::filesystem::path& path);

/// Makes a file where nothing was. `mode` counts, whatever the umask. Errors: already_exists, the
/// system's.
[[nodiscard]] Result<UniqueFd> make_guarded(const std::filesystem::path& path, mode_t mode);

/// Opens the file, or makes it when there is none. For locks. Errors: those of both.
[[nodiscard]] Result<UniqueFd> open_or_make_guarded(const std::filesystem::path& path, mode_t mode,
                                                    uid_t also = kNoOtherOwner);

/// Puts a new file with `bytes` in the place of whatever has the name: a reader gets the old one or
/// the new one. A link that stands there is replaced, and what it names stays as it was. Error: the
/// system's; the old one then stays.
[[nodiscard]] Result<void> replace_guarded(const std::filesystem::path& path, std::string_view bytes,
                                           mode_t mode);

/// Opens a folder itself, never what a link names. Errors: not_found, not_permitted (no folder),
/// the system's.
[[nodiscard]] Result<UniqueFd> open_folder_guarded(const std::filesystem::path& path);

/// A folder for this user's own files: made when missing with `mode` (0700 or 0755), and believed
/// only when it is a folder of this user in which no other can write. Errors: not_permitted, the
/// system's.
[[nodiscard]] Result<void> make_own_folder(const std::filesystem::path& path, mode_t mode);

}  // namespace qduino::posix
