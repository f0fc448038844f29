// A thread of another process that can be stopped and let go, whatever it does about it.
//
//   hold()     PTRACE_SEIZE, PTRACE_INTERRUPT; SCHED_OTHER
//                 it stops on its way out of the kernel: no mask, handler or lock of its own can
//                 keep it. In a long system call it goes on, but as an ordinary thread
//   release()  its priority, its core; PTRACE_DETACH
//
// ptrace(2) is the only way of stock kernels to stop one thread of several without its help: a
// stopping signal stops the whole process. The thread is let go of altogether while it runs,
// because every signal to a thread that is traced stops it until the tracer has seen it. If the
// holder dies, the kernel lets the thread go, as an ordinary one.
//
// Where ptrace() is refused (a debugger has the thread; another user's) only its rank is taken.
//
// System calls only, no heap: may be used by a child of fork() and at any priority.
#pragma once

#include <sys/types.h>

namespace qduino::board::linux {

/// Where a thread belongs.
struct ThreadPlace {
    pid_t tid = 0;
    int core = 0;
    int priority = 0;  ///< SCHED_FIFO; 0: an ordinary thread
};

class HeldThread {
  public:
    HeldThread() = default;  ///< for arrays only
    explicit HeldThread(const ThreadPlace& place) : place_(place) {}

    [[nodiscard]] const ThreadPlace& place() const { return place_; }
    /// Stops it soon. No effect while it is held.
    void hold();
    /// Lets it go, at once or when it has stopped.
    void release();
    [[nodiscard]] bool held() const { return state_ != State::free; }
    /// What waitpid() told of it.
    void changed(int status);

    /// Takes the priority of a thread, of whatever process.
    static void demote(pid_t tid);
    /// Gives a thread the priority that it belongs to.
    static void promote(const ThreadPlace& place);
    /// Gives it its priority and its core, when somebody has changed them. True: somebody had.
    [[nodiscard]] bool put_back() const;
    /// The calling process may stop it: seizes it, waits for it to stop (50 ms at most), and lets
    /// it go.
    [[nodiscard]] bool can_be_stopped();

  private:
    enum class State {
        free,
        demoted,   // it could not be seized
        stopping,  // seized; waitpid() will tell
        stopped,
    };
    void let_go();

    ThreadPlace place_;
    State state_ = State::free;
    bool to_be_held_ = false;
    int signal_ = 0;  // that it was about to get when it stopped
};

}  // namespace qduino::board::linux
