// Another user of the computer, as an attacker: a child process that has become one.
#pragma once

#include <grp.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <utility>

#include "posix/unique_fd.h"

namespace qduino::test {

/// Neither root, nor nobody, nor a user whom the tests' computer is likely to have.
inline constexpr uid_t kStranger = 54'321;

/// Why there can be no stranger; empty: there can.
inline std::string why_no_stranger() {
    return ::geteuid() == 0 ? "" : "only root can act as another user: run this test as root";
}

/// Does `attack()` as the stranger, and holds what that opened while this object lives.
class Stranger {
  public:
    /// `attack` returns true when it got what it wanted.
    template <typename Attack>
    explicit Stranger(Attack attack) {
        int ends[2] = {-1, -1};
        if (::pipe(ends) != 0) return;
        const posix::UniqueFd told{ends[0]};
        posix::UniqueFd tell{ends[1]};
        pid_ = ::fork();
        if (pid_ == 0) {
            ::prctl(PR_SET_PDEATHSIG, SIGKILL);
            const bool became =
                ::setgroups(0, nullptr) == 0 && ::setgid(kStranger) == 0 && ::setuid(kStranger) == 0;
            const char got = became && attack() ? 'y' : 'n';
            static_cast<void>(!::write(tell.get(), &got, 1));
            for (;;) ::pause();
        }
        tell.reset();
        char got = 'n';
        succeeded_ = ::read(told.get(), &got, 1) == 1 && got == 'y';
    }
    ~Stranger() {
        if (pid_ <= 0) return;
        ::kill(pid_, SIGKILL);
        ::waitpid(pid_, nullptr, 0);
    }
    Stranger(const Stranger&) = delete;
    Stranger& operator=(const Stranger&) = delete;

    [[nodiscard]] bool succeeded() const { return succeeded_; }

  private:
    pid_t pid_ = -1;
    bool succeeded_ = false;
};

}  // namespace qduino::test
