// Root acts as another user for a while: the kernel then judges each access to a file by that
// user's rights. So what this user has planted in his own folder (a link to a file of root) opens
// for root no door that it does not open for him.
#pragma once

#include <sys/types.h>

namespace qduino::posix {

/// While it lives, this thread touches files as `user` and `group`. Does nothing in a process that
/// is not root's. Not nested. The files that are open already stay so.
class [[nodiscard]] ActingAs {
  public:
    ActingAs(uid_t user, gid_t group);
    ~ActingAs();
    ActingAs(const ActingAs&) = delete;
    ActingAs& operator=(const ActingAs&) = delete;
};

}  // namespace qduino::posix
