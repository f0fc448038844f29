#include "board/linux/loop/warden.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

#include "base/text.h"
#include "board/linux/kernel/clock.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::board::linux {

namespace {

/// It may be an ordinary process of a busy computer.
constexpr Nanoseconds kBeginsWithin = 5s;

/// An ordinary process waits for others, and so do its looks.
constexpr Nanoseconds kOrdinarySilence = 10s;

#ifndef PR_SET_PTRACER
#define PR_SET_PTRACER 0x59616d61
#endif

}  // namespace

Result<void> Warden::hire(WardenTask task) {
    if (pid_ != 0) return {};
    QDUINO_TRY_ASSIGN(pages_of_orders_, posix::map_anonymous(sizeof(WardenOrders)));
    const posix::UniqueFd memory{::memfd_create("warden", MFD_CLOEXEC | MFD_ALLOW_SEALING)};
    if (!memory.valid() || ::ftruncate(memory.get(), sizeof(WardenFindings)) != 0)
        return posix::system_error("make", "the pages of the warden");
    QDUINO_TRY_ASSIGN(const posix::Mapping written,
                      posix::map_shared(memory.get(), 0, sizeof(WardenFindings), true));
    task.sketch = ::getpid();
    task.patience = patience_ = task.priority > 0 ? kWardenSilence : kOrdinarySilence;
    // No signal at its end: the sketch's own wait() knows nothing of this child (clone(2)).
    const long child = ::syscall(SYS_clone, 0, nullptr, nullptr, nullptr, nullptr);
    if (child < 0) return posix::system_error("start", "the warden of the budgets");
    if (child == 0) be_warden(task, *pages_of_orders_.as<WardenOrders>(), *written.as<WardenFindings>());
    pid_ = static_cast<pid_t>(child);
    ended_ = begun_ = false;
    // Its own mapping stays: it was there before. One that is made now cannot become writable. A
    // kernel before 5.1 knows no such seal.
    ::fcntl(memory.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE | F_SEAL_SEAL);
    auto findings = posix::map_read_only(memory.get(), sizeof(WardenFindings));
    if (!findings) {
        dismiss();
        return findings.error();
    }
    pages_of_findings_ = std::move(*findings);
    // Where only ancestors may stop a process (Yama), it is allowed to, too. Elsewhere refused.
    ::prctl(PR_SET_PTRACER, static_cast<unsigned long>(pid_), 0, 0, 0);
    return {};
}

Result<void> Warden::watch(std::span<const Ward> wards, std::span<const KernelThread> kernel_threads,
                           pid_t witness, bool grows) {
    if (pid_ == 0) return make_error(ErrorCode::unavailable, "no warden");
    WardenOrders& orders = *pages_of_orders_.as<WardenOrders>();
    std::ranges::copy(wards, orders.wards.begin());
    orders.count = static_cast<std::uint32_t>(wards.size());
    std::ranges::copy(kernel_threads, orders.kernel_threads.begin());
    orders.kernel_count = static_cast<std::uint32_t>(kernel_threads.size());
    orders.witness = witness;
    orders.grows = grows;
    orders.given = 1;
    ring();
    const Instant give_up = monotonic_now() + kBeginsWithin;
    while (findings()->state == WardenState::waiting && monotonic_now() < give_up && !has_ended())
        block_until(monotonic_now() + 200us);
    begun_ = watches();
    if (begun_) return {};
    if (findings()->state == WardenState::blind) {
        return make_error(ErrorCode::unavailable,
                          "this kernel does not tell the CPU time of threads (CONFIG_SCHED_INFO)");
    }
    return make_error(ErrorCode::unavailable, "the warden of the budgets did not begin");
}

void Warden::change(VcpuId io, sched::VcpuParameters parameters) {
    if (pid_ != 0) pages_of_orders_.as<WardenOrders>()->changes[io].put(parameters);
}

bool Warden::watches() const {
    if (pid_ == 0 || has_ended()) return false;
    const WardenState state = findings()->state;
    return state == WardenState::watching || state == WardenState::only_rank;
}

Nanoseconds Warden::silence() const { return monotonic_now() - instant_from_ns(findings()->beat_ns); }

bool Warden::is_lost() const { return pid_ != 0 && begun_ && (has_ended() || silence() > patience_); }

FixedString<160> Warden::lapse() const {
    FixedString<160> why;
    if (pid_ == 0 || !begun_) return why;
    const auto seconds = [](Nanoseconds time) { return Fixed{to_seconds(time), 1}; };
    if (has_ended()) {
        write(why, "the warden died ", seconds(silence()), " s ago: it was killed");
    } else if (silence() > patience_) {
        write(why, "the warden has not looked for ", seconds(silence()),
              " s: it was stopped, or is no warden any more");
    } else if (const Nanoseconds gap{findings()->gap_ns}; gap > patience_) {
        write(why, "the warden did not look for ", seconds(gap),
              " s: it, or the whole computer, was stopped");
    }
    return why;
}

/// It sleeps for this signal.
void Warden::ring() const { ::kill(pid_, SIGCHLD); }

bool Warden::has_ended() const {
    if (!ended_) ended_ = ::waitpid(pid_, nullptr, __WALL | WNOHANG) != 0;
    return ended_;
}

void Warden::dismiss() {
    if (pid_ == 0) return;
    pages_of_orders_.as<WardenOrders>()->go = 1;
    pages_of_orders_.as<WardenOrders>()->given = 1;
    ring();
    if (!ended_) ::waitpid(pid_, nullptr, __WALL);
    pid_ = 0;
}

}  // namespace qduino::board::linux
