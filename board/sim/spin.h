// Code that runs on and on at one instant: what is known of one such stretch, its place included.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "base/time.h"
#include "board/types.h"

namespace qduino::board::sim {

/// Return addresses, from the inside out.
struct CallStack {
    static constexpr std::size_t kDepth = 24;
    std::array<const void*, kDepth> address{};
    std::size_t depth = 0;
};

/// A spin of one VCPU, or of setup(). The last one that it was in.
struct Spin {
    Instant seen = Instant::min();  ///< when its code was looked at last
    std::uint32_t looks = 0;        ///< so often at that instant
    Instant begun = kEpoch;         ///< when the stretch began
    Nanoseconds lasted{};           ///< what it has taken; 0: it was no spin
    bool endless = false;           ///< a jump to itself: it never goes on
    CallStack stack;                ///< where it was when it was found
};

/// A spin, for a report.
struct SpinSeen {
    VcpuId vcpu = kNoVcpu;  ///< kNoVcpu: setup()
    bool goes_on = false;   ///< it had not ended when the run did
    Spin spin;
};

}  // namespace qduino::board::sim
