// A process tree in a VCPU, on a kernel with control groups of version 2.
#pragma once

namespace qduino::emulated {

/// True when this process is the tree's command, "/init spin": it spins with three children for
/// two seconds, and has ended when this returns.
bool is_spinner(int argc, char** argv);

/// Runs that in a VCPU of 10 ms in 100 ms on core 0. Prints what the kernel has counted, as JSON
/// behind "vcpu: ", and how many groups are left afterwards. From a process with one thread.
/// Returns 0, or 2 when no VCPU could be made.
int run_spinners();

}  // namespace qduino::emulated
