// STATE/run.log: all that the printer's processes say. The terminal gets what a person needs.
//
//   processes ──stdout, stderr──► run.log     appended by each of them, also after the launcher's
//   launcher  ──say()──► terminal, run.log    death; a pipe would be full or gone then
//
// The folder may belong to the service's user. So the file is made anew at each start, under a name
// that nothing else has (a link is not followed), and the one before is kept as run.log.1. A log
// that grew beyond kLimit keeps its end.
#pragma once

#include <sys/types.h>

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::launcher {

class RunLog {
  public:
    static constexpr off_t kLimit = 4 * 1024 * 1024;
    static constexpr off_t kKept = 1024 * 1024;
    static constexpr std::size_t kTail = 4096;

    RunLog() = default;  ///< none: what is said goes to the terminal alone
    /// Makes `folder`/run.log. Error: the system's.
    [[nodiscard]] static Result<RunLog> make(const std::filesystem::path& folder);

    /// For a child's output: each write is appended. −1: there is no log.
    [[nodiscard]] int descriptor() const { return file_.get(); }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// To the terminal (standard error) and, with the time before it, into the log.
    void say(std::string_view words) const;
    /// Its length now, for since().
    [[nodiscard]] off_t size() const;
    /// What was written from `begin` on: its last kTail bytes, without control characters. It may
    /// have been said by several processes.
    [[nodiscard]] std::string since(off_t begin) const;
    /// Cuts a log that has grown beyond `limit`.
    void keep_small(off_t limit = kLimit) const;

  private:
    std::filesystem::path path_;
    posix::UniqueFd file_;
};

/// `text` with a line end as its only control character: safe on a terminal, whoever wrote it.
[[nodiscard]] std::string plain_lines(std::string_view text);

}  // namespace qduino::launcher
