// One loop's answer of the completion-time analysis, by its id.
#pragma once

#include <cstddef>

#include "base/contract.h"
#include "sched/completion_time.h"

namespace qduino::sched {

inline std::size_t index_of(const CompletionTime& analysis, VcpuId id) {
    std::size_t i = 0;
    while (i < analysis.size() && analysis.loop(i).id != id) ++i;
    QDUINO_EXPECT(i < analysis.size());
    return i;
}

inline LoopResponse completion_time(const CoreLoad& load, VcpuId id) {
    const CompletionTime analysis{load};
    return analysis.verdicts()[index_of(analysis, id)];
}

inline Shares shares_in_window(const CoreLoad& load, VcpuId id, Nanoseconds window) {
    const CompletionTime analysis{load};
    return analysis.shares(index_of(analysis, id), window);
}

}  // namespace qduino::sched
