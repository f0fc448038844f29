// `qduino vcpu`: any command in an admitted, enforced VCPU.
#pragma once

#include "base/result.h"
#include "qduino/arguments.h"

namespace qduino::apps {

/// Runs `arguments.program` in a VCPU, to the end of its last process. Returns its exit status; 2
/// when admission refuses the VCPU, which is said. Error: no VCPU can be made: what to do.
[[nodiscard]] Result<int> run_in_vcpu(const Arguments& arguments);

}  // namespace qduino::apps
