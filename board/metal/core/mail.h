// What other cores have left for a core, one bit for each VCPU. They leave it and call the core; it
// takes everything up at its next interrupt. No lock: each kind is one atomic word.
//
//   core 0   post(33) ──┐
//   core 2   post(40) ──┴─► ▢▢▣▢▢▢▢▣▢  work of core 1 ─► take_all(): 33, 40
//            call()   ────► interrupt ──────────────────► enter()
#pragma once

#include <atomic>
#include <bit>
#include <cstdint>

#include "board/types.h"

namespace qduino::board::metal {

class Mailbox {
  public:
    void post(VcpuId id) { bits_.fetch_or(std::uint64_t{1} << id, std::memory_order_release); }
    /// Empties it, and calls `take` with each VCPU that was in it.
    template <typename Take>
    void take_all(Take take) {
        if (bits_.load(std::memory_order_relaxed) == 0) return;
        for (std::uint64_t left = bits_.exchange(0, std::memory_order_acquire); left != 0; left &= left - 1)
            take(static_cast<VcpuId>(std::countr_zero(left)));
    }

  private:
    static_assert(kVcpuLimit <= 64);
    std::atomic<std::uint64_t> bits_{0};
};

struct Mail {
    Mailbox work;                   ///< I/O VCPUs that have something to serve
    Mailbox locks;                  ///< VCPUs that were given the lock that they waited for
    Mailbox changes;                ///< I/O VCPUs that have another budget
    Mailbox ranks;                  ///< VCPUs that inherit another rank
    std::atomic<bool> host{false};  ///< the host is to run
};

}  // namespace qduino::board::metal
