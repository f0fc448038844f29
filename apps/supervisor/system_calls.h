// The system calls of the supervisor while a sketch runs or has just died. Tests replace them by
// calls that block, fail, or answer at once for ever.
#pragma once

#include <poll.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <sys/types.h>
#include <sys/wait.h>
#include <unistd.h>

namespace qduino::supervisor {

class SystemCalls {
  public:
    virtual ~SystemCalls() = default;
    virtual int poll(pollfd* events, nfds_t count, int timeout_ms) {
        return ::poll(events, count, timeout_ms);
    }
    virtual bool read_signal(int descriptor, signalfd_siginfo& signal) {
        return ::read(descriptor, &signal, sizeof signal) == sizeof signal;
    }
    virtual bool kill(int pidfd, int signal) {
        return ::syscall(SYS_pidfd_send_signal, pidfd, signal, nullptr, 0) == 0;
    }
    /// Collects a dead child. It may take any time in the kernel: never at real-time priority.
    virtual void reap(pid_t child) {
        siginfo_t info{};
        ::waitid(P_PID, static_cast<id_t>(child), &info, WEXITED);
    }
};

}  // namespace qduino::supervisor
