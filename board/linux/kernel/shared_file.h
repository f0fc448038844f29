// Files through which the programs of this computer meet: who owns a core (core_lock.h), and what
// is promised on it (core_promises.h).
//
// A folder in which every user may write would let any of them stop all others: by a lock that he
// holds for ever, or by a file of a terabyte. So each user has a folder of his own, and all read
// root's as well:
//
//   root           /run/qduino                   0755: others see what is root's
//   another user   /run/user/UID/qduino          0700; else /dev/shm/qduino-UID, /tmp/qduino-UID
//
//   who           believes
//   root          root's files
//   a user        root's files, and his own
//
// Root therefore does not see what a user's sketch has been promised. Such a sketch is found among
// the other real-time programs of a core (core_rivals.h).
//
// The lock of a file is a write lock (F_OFD_SETLK): only who may write to the file can take one.
// flock(2) would not do. It works on a descriptor for reading as well, so any user could hold
// root's files.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// No file of a register is longer. A longer one is not read.
inline constexpr std::size_t kRegisterFileBytesMax = 64 * 1024;

/// The folder in which this process's user registers; made when missing. `root` precedes the
/// folders (tests). Error: not_permitted, when none of them can be made, or is his alone.
[[nodiscard]] Result<std::string> own_register(const std::string& root);
/// The folders in which the files lie that this process believes: `own`, and root's.
[[nodiscard]] std::vector<std::string> believed_registers(const std::string& root, const std::string& own);

/// Locks the open file for this process and for who inherits the descriptor. It must be open for
/// writing. False: another one has it.
[[nodiscard]] bool lock_whole(int file);
/// Somebody else holds that lock. For reading is enough.
[[nodiscard]] bool is_locked(int file);

/// True while `path` still names the open file `file`: a holder that left has removed it.
[[nodiscard]] bool is_still_named(int file, const std::string& path);

/// A file that this process holds locked: what it stands for ends with this object, or with the
/// last process that inherited the descriptor.
class HeldFile {
  public:
    HeldFile() = default;  ///< holds nothing
    /// `file` is open at `path`, and locked.
    HeldFile(posix::UniqueFd file, std::string path) : path_(std::move(path)), file_(std::move(file)) {}
    HeldFile(HeldFile&&) = default;
    HeldFile& operator=(HeldFile&& other) noexcept;
    /// Gives it back; the file goes too.
    ~HeldFile() { release(); }
    HeldFile(const HeldFile&) = delete;
    HeldFile& operator=(const HeldFile&) = delete;

    [[nodiscard]] bool held() const { return file_.valid(); }
    [[nodiscard]] int descriptor() const { return file_.get(); }
    [[nodiscard]] const std::string& path() const { return path_; }

  private:
    void release();

    std::string path_;
    posix::UniqueFd file_;
};

/// `raw` in printable characters, on one line, with at most `longest` of them.
[[nodiscard]] std::string printable(std::string_view raw, std::size_t longest);

}  // namespace qduino::board::linux
