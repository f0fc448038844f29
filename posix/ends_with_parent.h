// A process that ends with its parent (PR_SET_PDEATHSIG) loses that with each change of its user,
// and with that of the user by whose rights it touches files: the kernel forgets the signal then
// (prctl(2)). Nobody would end it when its parent is killed.
#pragma once

#include <sys/prctl.h>
#include <unistd.h>

#include <csignal>

namespace qduino::posix {

/// Around such a change: keeps the signal that the process gets at its parent's end. A parent that
/// has ended meanwhile is made good for.
class [[nodiscard]] EndsWithParent {
  public:
    EndsWithParent() { ::prctl(PR_GET_PDEATHSIG, &signal_); }
    ~EndsWithParent() {
        if (signal_ == 0) return;
        ::prctl(PR_SET_PDEATHSIG, signal_);
        if (::getppid() != parent_) ::raise(signal_);
    }
    EndsWithParent(const EndsWithParent&) = delete;
    EndsWithParent& operator=(const EndsWithParent&) = delete;

  private:
    const pid_t parent_ = ::getppid();
    int signal_ = 0;
};

}  // namespace qduino::posix
