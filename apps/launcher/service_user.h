// The system's user that the print service is, when root starts the printer.
//
// It must be nobody else's. As "nobody" the service would share its files and its processes with
// every other program that is run this way, and whatever breaks into one of them has the printer,
// too.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "base/result.h"

namespace qduino::launcher {

/// The name that ./run gives.
inline constexpr const char* kServiceUser = "qduino-printer";

struct ServiceUser {
    uid_t user = 0;
    gid_t group = 0;
};

/// The user `name`. As root, and when it is kServiceUser and missing, it is made first: a system
/// user without a home, a shell or a password (useradd, adduser or systemd-sysusers). Errors:
/// not_found (no such user, with the command that makes one), not_permitted (root itself).
[[nodiscard]] Result<ServiceUser> find_or_make_user(const std::string& name);

}  // namespace qduino::launcher
