// Which files a loop may write: all but those by which a program changes the kernel or another
// process.
//
//   /proc          no: memory of other processes, their chance in need of memory, the kernel's own
//                  settings. But /proc/irq: noInterrupts() in a loop writes there
//   /sys/fs        no: control groups freeze, and move, any process
//   /sys/kernel, /sys/devices/system    no: cores go off line there
//   all else       yes: devices, pins, network cards, files
//
// A filter of system calls sees no names of files, and root may open all of them. Landlock
// (landlock(7), Linux 5.13) binds a thread and its children, whoever they are. It also keeps them
// from tracing processes outside, and from changing what is mounted. It knows trees that are
// allowed, and no exceptions: so what is beside the exceptions is allowed, folder by folder, as it
// is when the loops begin. A descriptor that was open before is not affected.
#pragma once

#include "base/result.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

/// The rules, for restrict_written_files() of each loop. Setup-time. Errors: unsupported (the
/// kernel has no Landlock, or it is off), the system's.
Result<posix::UniqueFd> rules_for_written_files();

/// Binds the calling thread for good. Its process may become nobody else (PR_SET_NO_NEW_PRIVS), or
/// the thread has CAP_SYS_ADMIN; else nothing happens. No heap.
void restrict_written_files(int rules);

}  // namespace qduino::board::linux
