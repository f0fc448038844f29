// The CPU time of a thread of any process, as the kernel tells it: /proc/PID/task/TID/schedstat,
// kept open.
//
// Of a running thread the kernel's figure is as old as its last tick. No heap: may be used in a
// child of fork() and at any priority.
#pragma once

#include <sys/types.h>

#include "sched/budget_watch.h"

namespace qduino::board::linux {

class ThreadTimesFile {
  public:
    /// `process` is the thread's own for a thread of the kernel. False: this kernel does not tell
    /// its times, or there is no such thread.
    [[nodiscard]] bool open(pid_t process, pid_t tid);
    /// False: the thread has ended.
    [[nodiscard]] bool read(sched::ThreadTimes& times) const;

  private:
    int file_ = -1;  // until the process ends
};

}  // namespace qduino::board::linux
