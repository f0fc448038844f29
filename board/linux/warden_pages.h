// The two pages between a sketch and its warden (warden.h). The sketch writes orders, the warden
// writes findings; neither writes the other's page. Zeroes are the first state of both.
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstdint>

#include "board/linux/parameters_mail.h"
#include "board/types.h"

namespace qduino::board::linux {

/// A thread that is kept to its budget.
struct Ward {
    VcpuId id = kNoVcpu;
    pid_t tid = 0;
    int core = 0;
    int priority = 0;  ///< SCHED_FIFO; 0: it is an ordinary thread
    Nanoseconds budget{};
    Nanoseconds period{};
    Nanoseconds client_period{};  ///< of an I/O VCPU; 0: its own period
    bool watched = false;         ///< false: known, but its budget is not enforced

    [[nodiscard]] bool is_io() const { return id >= kFirstIoVcpu; }
};

/// The most kernel threads that the bottom halves of a sketch may have together.
inline constexpr std::size_t kKernelThreadsMax = 128;

/// A kernel thread that works on the budget of an I/O VCPU.
struct KernelThread {
    VcpuId io = kNoVcpu;
    pid_t tid = 0;
    int priority = 0;  ///< SCHED_FIFO
};

struct WardenOrders {
    /// 1: what follows is complete. The warden reads it once.
    std::atomic<std::uint32_t> given;
    /// 1: it may go once its wards have ended. Not before: a sketch could write this.
    std::atomic<std::uint32_t> go;
    pid_t witness;  ///< a thread of the board's with a higher priority; 0: none
    std::uint32_t count;
    std::array<Ward, kVcpuLimit> wards;
    std::uint32_t kernel_count;
    std::array<KernelThread, kKernelThreadsMax> kernel_threads;
    /// Other budgets and periods of wards, by VCPU; of I/O VCPUs alone. A handler that forged one
    /// would have a budget that nobody admitted; a loop has no such way.
    std::array<ParametersMail, kVcpuLimit> changes;
};

enum class WardenState : std::uint32_t {
    waiting,  ///< for orders
    watching,
    only_rank,  ///< watching; it may not stop threads, but takes their priority from them
    blind,      ///< this kernel does not tell a thread's CPU time; it has gone
};

/// Why a thread took more than its budget, as far as that can be seen from outside.
enum class EscapeWay : std::uint32_t { none, signal_blocked, signal_ignored, unknown };

struct WardFindings {
    std::atomic<std::int64_t> used_ns;     ///< CPU time since the orders
    std::atomic<std::int64_t> watched_ns;  ///< the time since then
    std::atomic<std::uint32_t> holds;      ///< how often it was stopped
    std::atomic<std::uint32_t> changes;    ///< of its priority or core, by somebody else
    std::atomic<EscapeWay> way;
    // Of an I/O VCPU with kernel threads: of all that works on its budget.
    std::atomic<std::int64_t> kernel_used_ns;
    std::atomic<std::uint32_t> kernel_holds;  ///< how often their priority was taken
};

struct WardenFindings {
    std::atomic<WardenState> state;
    std::atomic<std::int64_t> cpu_ns;  ///< what the warden itself has used
    std::atomic<std::uint64_t> looks;
    /// Threads of the process that the board does not know: the most at a time.
    std::atomic<std::uint32_t> strangers;
    /// Those of them that had made themselves real-time, and were stopped for good.
    std::atomic<std::uint32_t> usurpers;
    std::array<WardFindings, kVcpuLimit> wards;
};

}  // namespace qduino::board::linux
