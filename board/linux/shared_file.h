// Files through which the programs of this computer meet, whichever user runs them: who owns a core
// (core_lock.h), and what is promised on it (core_promises.h).
//
// They lie in /run/lock, or in /dev/shm, or in /tmp: the first in which every user may make files,
// so that root's program and another user's meet. Others may have written them: what is read from
// them is checked.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// The first folder in which every user may make files; else the first in which this process may.
/// Empty: none. `root` precedes the folders (tests).
[[nodiscard]] std::string shared_folder(const std::string& root);

/// Opens the file at `path` if it is there, else makes it, readable and writable for all users.
/// Not valid: the system refused, and errno says why.
[[nodiscard]] posix::UniqueFd open_shared_file(const std::string& path);

/// True while `path` still names the open file `file`: a holder that left has removed it.
[[nodiscard]] bool is_still_named(int file, const std::string& path);

/// A file that this process holds locked (flock(2)): what it stands for ends with this object, or
/// with the last process that inherited the descriptor.
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
