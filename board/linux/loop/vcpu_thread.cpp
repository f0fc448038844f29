#include "board/linux/loop/vcpu_thread.h"

#include <sys/syscall.h>
#include <unistd.h>

#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/control_groups.h"
#include "board/linux/kernel/futex.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/real_time_mark.h"
#include "posix/signal_stack.h"

namespace qduino::board::linux {

namespace {

/// A cpuset does not let a thread out; what is started by taskset(1) may leave.
FixedString<160> why_not_there(int core, const Error& error) {
    const CpuList allowed = cores_of_cpuset();
    if (allowed.empty() || allowed.has(core)) return error.message.view();
    return text<FixedString<160>>("core ", core, " is not in its cpuset (", allowed.to_list(),
                                  "): it runs on another; give the loop one of those");
}

}  // namespace

constinit thread_local VcpuThread* VcpuThread::current_ = nullptr;

Result<void> VcpuThread::create() {
    const auto name = text<FixedString<8>>("loop ", spec_.id);
    QDUINO_TRY_ASSIGN(thread_, make_thread(name, options_.stack_bytes, &VcpuThread::main, this));
    created_ = true;
    return {};
}

void VcpuThread::join() {
    if (created_) ::pthread_join(thread_, nullptr);
    created_ = false;
}

void VcpuThread::prepare() {
    tid_ = static_cast<pid_t>(::syscall(SYS_gettid));
    name_thread(text<FixedString<8>>(spec_.is_io() ? "io " : "loop ", spec_.id));
    if (options_.isolation) {
        if (const auto entered = options_.isolation->adopt(spec_.core, tid_); !entered)
            add_shortfall(entered.error().message);
    }
    const auto pinned = pin_to_core(spec_.core);
    pinned_ = pinned.ok();
    if (!pinned) add_shortfall(why_not_there(spec_.core, pinned.error()));
    wake_on_time();
    touch_stack();
    if (options_.priority != 0) {
        if (auto real_time = become_real_time(options_.priority); real_time) {
            real_time_ = true;
            spin_ = SpinAllowance{options_.spin_share, monotonic_now()};
            gravity_ = TimerGravity{TimerGravity::lead_limit(spec_.budget, options_.enforce_budget)};
        } else {
            add_shortfall(why_no_real_time());
        }
    }
    become_confined();  // takes longer than a small budget: before the account begins
    if (options_.enforce_budget) {
        const auto kept = keeper_.start(spec_, real_time_ ? options_.priority : 0, options_.life);
        budget_kept_ = kept.ok();
        if (!kept) add_shortfall(kept.error().message);
    }
}

/// A kernel that cannot confine it leaves more to the warden.
void VcpuThread::become_confined() const {
    if (!options_.confinement) return;
    Confinement mine = *options_.confinement;
    mine.may_make_threads = spec_.classic;
    if (real_time_ && options_.enforce_budget) mine.own_rank = keeper_.own_rank();
    static_cast<void>(confine(mine));
}

void VcpuThread::rest(Instant t) {
    const Instant now = monotonic_now();
    if (const Instant until = spin_.sleep_first(now, t); until > now) sleep(now, until);
}

void VcpuThread::sleep_towards(Instant t) {
    const Instant now = cycle_clock.now();
    if (t <= now) return;
    gravity_.woke(sleep(now, real_time_ ? gravity_.alarm_for(t, now) : t));
}

/// Counted as rest. Returns the instant at which it ended.
Instant VcpuThread::sleep(Instant now, Instant t) {
    if (spin_.limited()) spin_.ran(now);
    keeper_.before_block(t);
    block_until(t);
    const Instant woke = cycle_clock.now();
    keeper_.after_block(woke);
    if (spin_.limited()) spin_.slept(woke);
    slept_ += woke - now;
    ++sleeps_;
    return woke;
}

void VcpuThread::add_shortfall(std::string_view text) {
    write(shortfall_, shortfall_.empty() ? "" : "; ", text);
}

void* VcpuThread::main(void* self) {
    auto& thread = *static_cast<VcpuThread*>(self);
    const posix::SignalStack signal_stack;
    current_ = &thread;
    thread.prepare();
    StartGate& gate = *thread.options_.gate;
    thread.at_gate_.store(true, std::memory_order_release);
    gate.ready.fetch_add(1);
    futex_wake_all(gate.ready);
    thread.before_block();
    while (gate.state.load(std::memory_order_acquire) == 0) futex_wait_until(gate.state, 0, kForever);
    thread.after_block();
    if (gate.state.load() == 1) {
        const RealTimeSection begun{thread.spec_.classic ? kNoVcpu : thread.spec_.id};
        thread.spec_.entry(thread.spec_.context);
    }
    thread.keeper_.stop();
    if (thread.options_.life) thread.options_.life->idle(thread.spec_.id);
    thread.finished_.store(true, std::memory_order_release);
    thread.options_.returned->fetch_add(1);
    futex_wake_all(*thread.options_.returned);
    current_ = nullptr;
    return nullptr;
}

}  // namespace qduino::board::linux
