#include "posix/acting_as.h"

#include <sys/fsuid.h>
#include <unistd.h>

#include "posix/ends_with_parent.h"

namespace qduino::posix {

// The group first, and last: as another user it could not be changed.
ActingAs::ActingAs(uid_t user, gid_t group) {
    if (::geteuid() != 0) return;
    const EndsWithParent kept;
    ::setfsgid(group);
    ::setfsuid(user);
}

ActingAs::~ActingAs() {
    if (::geteuid() != 0) return;
    const EndsWithParent kept;
    ::setfsuid(0);
    ::setfsgid(::getegid());
}

}  // namespace qduino::posix
