// The CPU time of a thread of any process, as the kernel tells it: /proc/PID/task/TID/schedstat,
// kept open.
//
// The kernel's figure for a running thread is as old as its last tick. No heap: may be used in a
// child of fork() and at any priority.
#pragma once

#include <sys/types.h>

#include <array>
#include <string_view>

#include "sched/budget_watch.h"

namespace qduino::board::linux {

/// For the text of one small file of /proc.
using TaskText = std::array<char, 4096>;

/// The kernel's newest text of a file in /proc that is open; empty when the task has ended.
[[nodiscard]] std::string_view read_anew(int file, TaskText& buffer);

class ThreadTimesFile {
  public:
    /// `process` is the thread's own for a thread of the kernel. False: this kernel does not tell
    /// its times, or there is no such thread.
    [[nodiscard]] bool open(pid_t process, pid_t tid);
    /// False: the thread has ended.
    [[nodiscard]] bool read(sched::ThreadTimes& times) const;
    /// Else it is open until the process ends.
    void close();

  private:
    int file_ = -1;
};

}  // namespace qduino::board::linux
