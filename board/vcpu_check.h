// What a set of VCPUs has to keep to before a board that schedules them itself may start it.
#pragma once

#include <span>

#include "base/result.h"
#include "board/board.h"

namespace qduino::board {

/// `spec` among `all`: a number of its kind and of its own, an entry, 0 < budget <= period, and an
/// owned core for itself. Errors: invalid_argument, already_exists, not_permitted. Takes no memory.
[[nodiscard]] Result<void> check_vcpu(const VcpuSpec& spec, std::span<const VcpuSpec> all);

}  // namespace qduino::board
