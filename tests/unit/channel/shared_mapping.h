// Zeroed memory that survives fork() as one and the same on both sides.
#pragma once

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace qduino::channel {

/// A T in a fresh shared mapping, never constructed: all zeroes, as a new file's pages are.
template <typename T>
class SharedMapping {
  public:
    SharedMapping()
        : at_(mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {
        if (at_ == MAP_FAILED) throw std::bad_alloc{};
    }
    ~SharedMapping() { munmap(at_, sizeof(T)); }
    SharedMapping(const SharedMapping&) = delete;
    SharedMapping& operator=(const SharedMapping&) = delete;
    T& operator*() const { return *static_cast<T*>(at_); }
    T* operator->() const { return static_cast<T*>(at_); }

  private:
    void* at_;
};

/// Runs `body` in a child process; its exit status is what body returns.
template <typename Body>
pid_t in_child(Body body) {
    const pid_t child = fork();
    if (child == 0) _exit(body());
    return child;
}

inline int exit_status_of(pid_t child) {
    int status = 0;
    if (waitpid(child, &status, 0) != child) return -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

}  // namespace qduino::channel
