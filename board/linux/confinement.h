// What a loop's thread may not ask the kernel for once the loop runs: a filter of system calls
// (seccomp(2)), which its threads and children inherit and nobody can take away.
//
//   refused                                    because                                      answer
//   sched_setscheduler, -param, -attr          its priority is admission's business; the     EPERM
//                                              keeper of its budget may give it back
//   sched_setaffinity                          so is its core                                EPERM
//   ptrace, process_vm_writev, io_uring_setup, it would get at the warden                    EPERM
//   pidfd_send_signal; kill() of the warden
//   clone, fork, vfork                         a new thread has no budget. The classic       EAGAIN
//   execve                                     loop() may: its threads are ordinary ones     EPERM
//   another architecture's calls               the same by another number                   ENOSYS
//
// The kernel remembers the answer for each number that does not depend on arguments (since 5.11): a
// system call of a loop costs nothing more. setup() and the threads that it made are not confined.
#pragma once

#include <sys/types.h>

#include "base/result.h"

namespace qduino::board::linux {

struct Confinement {
    pid_t warden = 0;  ///< 0: none
    bool may_make_threads = false;
    /// Where the keeper has the thread's own sched_param: with any other the thread gets no
    /// SCHED_FIFO. Null: never.
    const void* own_rank = nullptr;
};

/// Confines the calling thread, for good. Error: the system's; without CONFIG_SECCOMP_FILTER.
Result<void> confine(const Confinement& confinement);

}  // namespace qduino::board::linux
