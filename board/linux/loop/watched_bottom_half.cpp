#include "board/linux/loop/watched_bottom_half.h"

#include <algorithm>

#include "board/linux/kernel/clock.h"

namespace qduino::board::linux {

bool WatchedBottomHalf::open(pid_t sketch, const Ward& ward, const WardenOrders& orders,
                             WardFindings& findings) {
    if (!ward.is_io() || !ward.watched) return false;
    const std::uint32_t count = std::min<std::uint32_t>(orders.kernel_count, kKernelThreadsMax);
    for (std::uint32_t i = 0; i < count; ++i) {
        const KernelThread& thread = orders.kernel_threads[i];
        if (thread.io != ward.id) continue;
        static_cast<void>(add(thread.tid, {thread.tid, ward.core, thread.priority}, true));
    }
    if (members_.empty() || !add(sketch, {ward.tid, ward.core, ward.priority}, false)) return false;
    changes_ = &orders.changes[ward.id];
    findings_ = &findings;
    watch_ = sched::IoWatch{
        {ward.budget, ward.period}, ward.client_period, sched::BudgetWatch::kTick, monotonic_now(), cpu()};
    set_rank(true);
    return true;
}

bool WatchedBottomHalf::add(pid_t process, const ThreadPlace& place, bool kernels) {
    Member member{.place = place, .times = {}, .kernels = kernels};
    return member.times.open(process, place.tid) && members_.try_push_back(member);
}

/// The CPU time of all members together. A member that has ended counts with its last reading.
Nanoseconds WatchedBottomHalf::cpu() {
    Nanoseconds sum{};
    for (Member& member : members_) {
        if (sched::ThreadTimes times; member.times.read(times)) member.cpu = times.cpu;
        sum += member.cpu;
    }
    return sum;
}

void WatchedBottomHalf::look(Instant now) {
    if (const auto parameters = changes_->take(changes_seen_); parameters && parameters->valid())
        watch_.change(now, cpu(), *parameters);
    const bool hold = watch_.look(now, cpu()) == sched::IoWatch::Verdict::hold;
    if (hold != held_) set_rank(!hold);
    // The kernel's figure of a running thread is old until its rank is taken.
    if (hold && !held_) watch_.held(monotonic_now(), cpu());
    held_ = hold;
    findings_->kernel_used_ns = to_ns(watch_.used());
    findings_->kernel_holds = watch_.holds();
}

void WatchedBottomHalf::set_rank(bool has_it) {
    for (const Member& member : members_) {
        if (member.kernels) has_it ? HeldThread::promote(member.place) : HeldThread::demote(member.place.tid);
    }
}

bool WatchedBottomHalf::has(pid_t tid) const {
    return std::ranges::any_of(members_, [tid](const Member& each) { return each.place.tid == tid; });
}

}  // namespace qduino::board::linux
