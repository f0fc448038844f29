#include "board/sim/block_count.h"

namespace qduino::board::sim {

constinit thread_local BlockCount block_count;

}  // namespace qduino::board::sim

// Named by the compiler: GCC manual, "Program Instrumentation Options", -fsanitize-coverage.
extern "C" void __sanitizer_cov_trace_pc() {  // NOLINT(bugprone-reserved-identifier)
    auto& count = qduino::board::sim::block_count;
    if (--count.left > 0) [[likely]]
        return;
    count.left = qduino::board::sim::kBlocksPerLook;
    if (count.watch) count.watch->look(__builtin_return_address(0));
}
