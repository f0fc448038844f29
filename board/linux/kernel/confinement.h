// What a loop's thread may not ask the kernel for once the loop runs: a filter of system calls
// (seccomp(2)), which its threads and children inherit and nobody can take away.
//
//   refused                                    because                                      answer
//   sched_setscheduler, -param, -attr          its priority is admission's business; the     EPERM
//                                              keeper of its budget may give it back
//   sched_setaffinity                          so is its core                                EPERM
//   ptrace, process_vm_writev, -madvise,       it would get at the warden                    EPERM
//   pidfd_send_signal, pidfd_getfd; kill()
//   of the warden
//   fcntl F_SETOWN, F_SETOWN_EX, F_SETSIG,     so would the kernel, for it: it sends a       EPERM
//   F_NOTIFY; ioctl FIOSETOWN, SIOCSPGRP       signal to whom a descriptor belongs
//   io_uring_setup, -enter, -register          the kernel would work for it, in a thread     EPERM
//                                              of its own
//   userfaultfd, perf_event_open, bpf          others would wait for it, or be interrupted   EPERM
//   timerfd_settime; limits of signals and     thousands of timers that run out at once      EPERM
//   of priorities                              are one long interrupt, in nobody's budget
//   prctl PR_SET_DUMPABLE, PR_SET_PTRACER      the warden could stop it no more              EPERM
//   clone, fork, vfork                         a new thread has no budget. The classic       EAGAIN
//   execve                                     loop() may: its threads are ordinary ones     EPERM
//   another architecture's calls               the same by another number                   ENOSYS
//
// The filter sees numbers and no names of files. So the thread loses the rights of root by which it
// could reach into the warden (/proc/PID/mem), and may write no file of the kernel's
// (written_files.h).
//
// The kernel remembers the answer for each number that does not depend on arguments (since 5.11): a
// system call of a loop costs nothing more, but fcntl, ioctl, prctl, kill and limits some 0.1 µs.
// setup() and the threads that it made are not confined: the warden looks at those.
#pragma once

#include <sys/types.h>

#include "base/result.h"

namespace qduino::board::linux {

struct Confinement {
    pid_t warden = 0;  ///< 0: none
    bool may_make_threads = false;
    /// A ruleset of written_files.h; −1: none.
    int written_files = -1;
    /// Where the keeper has the thread's own sched_param: with any other the thread gets no
    /// SCHED_FIFO. Null: never.
    const void* own_rank = nullptr;
};

/// Confines the calling thread, for good. Error: the system's; without CONFIG_SECCOMP_FILTER.
Result<void> confine(const Confinement& confinement);

}  // namespace qduino::board::linux
