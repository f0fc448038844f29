#include "board/vcpu_check.h"

namespace qduino::board {

Result<void> check_vcpu(const VcpuSpec& spec, std::span<const VcpuSpec> all) {
    const bool main = !spec.is_io();
    if (main ? spec.id < 1 || spec.id > kMaxLoop : spec.id < kFirstIoVcpu || spec.id >= kVcpuLimit)
        return make_error(ErrorCode::invalid_argument, "a VCPU's number is 1…32 (loop) or 33…63 (I/O)");
    if (main && !spec.entry) return make_error(ErrorCode::invalid_argument, "a loop without an entry");
    if (!spec.parameters().valid())
        return make_error(ErrorCode::invalid_argument, "a VCPU needs 0 < budget <= period");
    for (const VcpuSpec& other : all) {
        if (&other == &spec) continue;
        if (other.id == spec.id)
            return make_error(ErrorCode::already_exists, "start: two VCPUs of one number");
        if (spec.owns_core && other.core == spec.core)
            return make_error(ErrorCode::not_permitted, "a loop owns its core: nothing else may run there");
    }
    return {};
}

}  // namespace qduino::board
