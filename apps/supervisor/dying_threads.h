// The threads of a killed process, on their way out.
//
// A killed thread ends in the kernel, and for that it has to run once more. Behind a real-time task
// of equal or higher priority it does not: for as long as that task spins, the process is not dead,
// and keeps its GPIO lines, its locks on cores, and the computer's changed settings. The kernel's
// own account makes no exception for the dying.
//
//   thread      on core 1, behind ██████ a spinner with any priority
//   1. it leaves that core: to any other that this process may use. The kernel moves a thread that
//      waits at once, whatever runs on the two cores
//   2. it gets a rank above every loop (raise), where this process has one itself: its new core may
//      be busy, too
//   3. it may use all cores of this process again
//
// A thread in a cpuset of its owned core alone cannot leave it. It gets SCHED_DEADLINE, which goes
// before every priority; the kernel gives it only to a thread that may use all cores of its cpuset.
#pragma once

#include <sys/types.h>

namespace qduino::supervisor {

/// Does 1 to 3 for every thread of `process`, which has been killed. `raise`: 2. It looks at no
/// other process and waits for none; at any priority. What is refused is left as it is.
void let_threads_die(pid_t process, bool raise);

/// Makes all of them ordinary threads. A rank above every loop is for moments: on its way out a
/// thread may wait, without sleeping, for an ordinary reader of its files in /proc. The caller's
/// own rank is higher, so it always comes to this.
void lower_threads(pid_t process);

}  // namespace qduino::supervisor
