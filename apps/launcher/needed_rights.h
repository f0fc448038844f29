// The rights of root that each process of the printer needs, and none beside them.
// docs/privileges.md says what for; a test compares that page with the running processes.
#pragma once

#include <linux/capability.h>

#include <array>

namespace qduino::launcher {

/// Programs, page and machine file may lie in a home that is closed to others.
inline constexpr std::array kMachineRights{CAP_DAC_READ_SEARCH, CAP_SYS_NICE};

/// The supervisor, its heat watch and the sketch.
inline constexpr std::array kSketchRights{CAP_DAC_READ_SEARCH, CAP_NET_ADMIN, CAP_IPC_LOCK, CAP_SYS_NICE,
                                          CAP_SYS_RESOURCE};

/// printd needs these until it has become its user. Then it has none.
inline constexpr std::array kServiceRights{CAP_DAC_READ_SEARCH, CAP_SETGID, CAP_SETUID, CAP_SETPCAP,
                                           CAP_SYS_ADMIN};

/// printer-port needs these until it has become its user.
inline constexpr std::array kPortRights{CAP_DAC_READ_SEARCH, CAP_SETGID, CAP_SETUID, CAP_SETPCAP,
                                        CAP_SYS_RESOURCE};

/// The launcher hands them on. It also gives files away, acts as the service's user, and ends its
/// processes.
inline constexpr std::array kLauncherRights{CAP_CHOWN,     CAP_DAC_READ_SEARCH, CAP_KILL,        CAP_SETGID,
                                            CAP_SETUID,    CAP_SETPCAP,         CAP_NET_ADMIN,   CAP_IPC_LOCK,
                                            CAP_SYS_ADMIN, CAP_SYS_NICE,        CAP_SYS_RESOURCE};

}  // namespace qduino::launcher
