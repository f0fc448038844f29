// The two pages between a sketch and its warden (warden.h). The sketch writes orders, the warden
// writes findings; neither writes the other's page. The findings are sealed: once the warden has
// them, nobody else can map them to write, whatever his rights (F_SEAL_FUTURE_WRITE of fcntl(2)).
// Zeroes are the first state of both.
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstdint>

#include "base/time.h"
#include "board/linux/loop/parameters_mail.h"
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
    bool grows;     ///< a ward may make threads
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
enum class EscapeWay : std::uint32_t {
    none,
    signal_blocked,
    signal_ignored,
    unknown,
    lent,  ///< it waited for a lock, and the lock's holder, in nobody's budget, ran at its priority
};

struct WardFindings {
    std::atomic<std::int64_t> used_ns;     ///< CPU time since the orders
    std::atomic<std::int64_t> watched_ns;  ///< the time since then
    std::atomic<std::uint32_t> holds;      ///< how often it was stopped
    std::atomic<std::uint32_t> changes;    ///< of its priority or core, by somebody else
    std::atomic<EscapeWay> way;
    // An I/O VCPU with kernel threads: these count all that works on its budget.
    std::atomic<std::int64_t> kernel_used_ns;
    std::atomic<std::uint32_t> kernel_holds;  ///< how often their priority was taken
};

enum class StrangerKind : std::uint32_t {
    none,
    thread_ranked,   ///< a thread of the sketch made itself real-time, and was stopped
    process_ranked,  ///< a process that the sketch started did
    lent,            ///< a thread of the sketch ran at a loop's priority, which a lock lent to it
};

/// Somebody of the sketch's who is in no budget and ran in front of loops.
struct StrangerFindings {
    std::atomic<StrangerKind> kind;  ///< written last
    pid_t tid;
    std::array<char, 16> name;         ///< as the kernel has it, ended by a zero
    std::atomic<std::int64_t> cpu_ns;  ///< of kind lent: that it used so
    std::atomic<VcpuId> lender;        ///< of kind lent: whose budget paid
};

struct WardenFindings {
    std::atomic<WardenState> state;
    std::atomic<std::int64_t> cpu_ns;  ///< what the warden itself has used
    std::atomic<std::uint64_t> looks;
    std::atomic<std::int64_t> beat_ns;  ///< CLOCK_MONOTONIC of its last look
    std::atomic<std::int64_t> gap_ns;   ///< the longest time between two looks
    /// Threads of the process that the board does not know: the most at a time.
    std::atomic<std::uint32_t> strangers;
    /// Those of them that had made themselves real-time, and were stopped for good.
    std::atomic<std::uint32_t> usurpers;
    /// Then all others in nobody's budget were stopped, too.
    std::atomic<bool> all_stopped;
    std::array<StrangerFindings, 8> named;
    std::array<WardFindings, kVcpuLimit> wards;
};

/// The longest sleep of a warden that watches. It beats then, too.
inline constexpr Nanoseconds kWardenSweep = 200ms;
/// One that has not beaten for so long is dead, stopped, or no warden any more: a host's pauses are
/// shorter, but for the rarest.
inline constexpr Nanoseconds kWardenSilence = 1500ms;

}  // namespace qduino::board::linux
