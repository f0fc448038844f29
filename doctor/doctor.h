// `qduino doctor`: is this computer fit for real time, and what exactly would make it fitter?
//
//   facts (/proc, /sys, /dev) ─► checks, one small function each ─► findings ─► text or JSON
//
// It reads, and changes nothing. Every finding has a state, the fact, why it matters, and the fix:
// a command or a kernel parameter for Debian and Raspberry Pi OS.
#pragma once

#include <cstdio>
#include <string>

namespace qduino::apps {

struct DoctorOptions {
    bool json = false;
    std::string root;  ///< precedes /proc, /sys, /dev, /run and /boot (tests)
};

/// Checks the computer and prints the result to `out`. Blocks for some 0.3 s on a virtual machine
/// (it watches for stolen time). Returns 0 when nothing needs fixing, 1 when there are shortfalls.
int run_doctor(const DoctorOptions& options, std::FILE* out);

}  // namespace qduino::apps
