#include "board/metal/metal_board.h"

#include <algorithm>
#include <utility>

#include "base/contract.h"
#include "base/text.h"
#include "board/metal/computer/paging.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/linux_side.h"
#include "board/real_time_mark.h"
#include "board/vcpu_check.h"

namespace qduino::board::metal {
namespace {

constinit MetalBoard* the_board = nullptr;

/// The median of some, for an emulator's host may stop it in one of them.
template <typename Action>
Nanoseconds length_of(Action action) {
    std::array<Nanoseconds, 33> lengths;
    const InterruptsOff off;
    for (Nanoseconds& length : lengths) {
        const Instant before = computer_clock.now();
        action();
        length = computer_clock.now() - before;
    }
    std::nth_element(lengths.begin(), lengths.begin() + lengths.size() / 2, lengths.end());
    return lengths[lengths.size() / 2];
}

/// As a core decides (core/core.cpp), among four loops that all want to run, and whose budgets
/// outlast this, however slow the processor is.
Nanoseconds length_of_a_decision() {
    static sched::CoreScheduler scheduler;  // too large for a stack
    const Instant began = computer_clock.now();
    for (VcpuId id = 1; id <= 4; ++id) {
        static_cast<void>(scheduler.add(id, {.budget = 1h, .period = 10h}, began));
        scheduler.wake(id, began);
    }
    return length_of([] {
        const Instant now = computer_clock.now();
        scheduler.account(now);
        static_cast<void>(scheduler.available(*scheduler.decide(now).vcpu, now));
        scheduler.account(computer_clock.now());
    });
}

/// What a pass of the kernel takes, and how exact the ends of budgets were, where there were any.
FixedString<100> kernel_note(const CoreCounts& counts) {
    FixedString<100> note;
    if (const auto passes = static_cast<std::int64_t>(counts.passes.load()); passes > 0)
        write(note, ", kernel ", counts.kernel.load().count() / passes, " ns each of ", passes, " times");
    if (counts.ends.load() > 0)
        write(note, ", ends of budgets ", counts.ends.load(), ", at most ",
              counts.worst_overrun.load().count(), " ns late");
    return note;
}

constexpr std::uint64_t kTurns = 1024;

/// What kTurns of count_down() take, in counts of the clock: the longest of some.
std::uint64_t measure_turns() {
    std::uint64_t longest = 1;
    const InterruptsOff off;
    for (int i = 0; i < 3; ++i) {
        const std::uint64_t before = clock_count();
        count_down(kTurns);
        longest = std::max(longest, clock_count() - before);
    }
    return longest;
}

}  // namespace

MetalBoard::MetalBoard() {
    QDUINO_EXPECT(the_board == nullptr);
    the_board = this;
    entry_cost_ = length_of([] { Core::look_up(); });
    switch_cost_ = entry_cost_ + length_of_a_decision();
}

// ---- time ---------------------------------------------------------------------------------------

void MetalBoard::count_spins() { turns_take_ = measure_turns(); }

void MetalBoard::busy_until(Instant t) {
    if (t <= kEpoch) return;
    const std::uint64_t end = computer_clock.count_at(t);
    // The hint saves power and may take tens of nanoseconds, so not in the last microsecond.
    const std::uint64_t close = end - std::min(end, computer_clock.hz() / 1'000'000);
    // Counted is a quarter of what is left at a time, for the count may be slower now than it was
    // when it was measured.
    for (std::uint64_t now = clock_count(); turns_take_ != 0 && now + 4 * turns_take_ < close;
         now = clock_count())
        count_down((close - now) / 4 * kTurns / turns_take_);
    while (clock_count() < close) spin_hint();
    while (clock_count() < end) {
    }
}

void MetalBoard::sleep_until(Instant t) {
    Core& core = this_core();
    Thread* const self = core.running();
    if (!self || !core.alarms_allowed()) return busy_until(t);
    const InterruptsOff off;
    const Instant before = now();
    if (t <= before) return;
    self->slept += t - before;
    core.sleep_until(t);
}

// ---- VCPUs --------------------------------------------------------------------------------------

Instant MetalBoard::handler_came() const {
    const Thread* const self = this_core().running();
    return self ? self->came : kForever;
}

Nanoseconds MetalBoard::slept() const {
    const Thread* const self = this_core().running();
    return self ? self->slept : Nanoseconds{0};
}

Nanoseconds MetalBoard::cpu_time() {
    const InterruptsOff off;
    return this_core().running() ? this_core().cpu_time() : Nanoseconds{0};
}

void MetalBoard::note_release(Instant nominal) {
    const InterruptsOff off;
    const Thread* const self = this_core().running();
    if (self && self->spec.deferrable) this_core().release(nominal);
}

Result<void> MetalBoard::start(std::span<const VcpuSpec> specs) {
    if (began_ != kForever) return make_error(ErrorCode::already_exists, "start: the board runs already");
    for (const VcpuSpec& spec : specs) {
        if (!is_ours(spec.core))
            return make_error(ErrorCode::not_found, "a VCPU asks for a core that is not there");
        QDUINO_TRY(check_vcpu(spec, specs));
    }
    began_ = now();
    for (const VcpuSpec& spec : specs) QDUINO_TRY(add_thread(spec, began_));
    device_interrupts.route_all();
    return {};
}

Result<void> MetalBoard::add_thread(const VcpuSpec& spec, Instant now) {
    Thread& thread = threads[spec.id];
    thread.spec = spec;
    thread.rank = {spec.period, spec.id};
    thread.context.thread_locals = make_thread_locals();
    thread.context.begin(&thread_main, &thread, stack_top(spec.id));
    thread.state = ThreadState::sleeping;
    thread.wake = now;
    thread.serving.store(spec.is_io() && !spec.entry);
    if (!core_at(spec.core).add(thread, 2 * switch_cost_, now))
        return make_error(ErrorCode::invalid_argument, "a VCPU needs a number of its own");
    if (!spec.is_io()) loops_left_.fetch_add(1);
    threads_left_.fetch_add(1);
    return {};
}

void MetalBoard::thread_main(void* context) {
    Thread& self = *static_cast<Thread*>(context);
    {
        const RealTimeSection section(self.spec.classic ? kNoVcpu : self.spec.id);
        if (self.spec.entry)
            self.spec.entry(self.spec.context);
        else
            serve_work(self, the_board->loops_over_);
    }
    disable_interrupts();
    static_cast<void>(this_core().cpu_time());  // whoever waits for this end may read it
    const bool last_loop = !self.spec.is_io() && the_board->loops_left_.fetch_sub(1) == 1;
    const bool last = the_board->threads_left_.fetch_sub(1) == 1;
    if (last_loop || last) host_core().call_host();
    this_core().finish();
}

/// With the first run all cores begin at once. Otherwise those of the first core would begin in the
/// middle of a period: it is the host's before that, which may say long reports.
void MetalBoard::run(Instant until) {
    if (began_ != kForever && !std::exchange(runs_, true)) {
        began_ = now();
        for (int core = first_core(); core < core_count(); ++core) core_at(core).begin_threads();
    }
    while (!ended_ && now() < until) {
        if (loops_left_.load() == 0) return end();
        host_core().let_threads_run(std::min(until, linux_side.next_look()));
        if (linux_side.look(now()) && !stop_requested()) return;
    }
}

/// The loops have returned. Until now a storm of interrupts had to keep to the budgets of I/O
/// VCPUs, which end by themselves now. One whose handler does not return for a tenth of a second is
/// left where it is.
void MetalBoard::end() {
    ended_ = true;
    stop_.store(true);
    loops_over_.store(true);
    for (const Thread& thread : threads) {
        if (!thread.serving.load()) continue;
        core_of(thread).mail().work.post(thread.spec.id);
        core_of(thread).call();
    }
    const Instant give_up = now() + 100ms;
    while (threads_left_.load() > 0 && now() < give_up) host_core().let_threads_run(give_up);
    pins.force_safe_levels();
    device_interrupts.serve_all();
}

// ---- what the kernel takes ----------------------------------------------------------------------

sched::PlatformOverheads MetalBoard::platform_overheads(int core) {
    sched::PlatformOverheads overheads;
    if (!is_ours(core)) {  // all of it is taken
        overheads.add({.name = "Linux, whose core it is", .cost = 1s, .interval = 1s, .jitter = {}});
        return overheads;
    }
    if (linux_side.exists())  // to the host and back
        overheads.add({.name = "looks at Linux's heartbeat",
                       .cost = 3 * switch_cost_,
                       .interval = linux_side.interval(),
                       .jitter = {}});
    // To it and back; and once more when its budget ends.
    overheads.release_cost = overheads.enforcement_cost = overheads.wait_cost = 2 * switch_cost_;
    if (const int devices = device_interrupts.count_on(core); devices > 0) {
        // A byte at 115,200 baud takes 86.8 us, and each may interrupt. A top half is a way into
        // the kernel with a few ports to write: counted as two of them.
        overheads.add({.name = "top halves",
                       .cost = 2 * devices * entry_cost_,
                       .interval = Nanoseconds{86'800},
                       .jitter = {}});
    }
    return overheads;
}

Result<void> MetalBoard::serve_interrupts(DeviceClass device, VcpuId io) {
    if (io != kNoVcpu && (io < kFirstIoVcpu || io >= kVcpuLimit))
        return make_error(ErrorCode::invalid_argument, "serve_interrupts: not the number of an I/O VCPU");
    device_interrupts.serve_on(device, io);
    return {};
}

Result<void> MetalBoard::change_io(VcpuId io, sched::VcpuParameters parameters) {
    if (io >= kVcpuLimit || !threads[io].serving.load())
        return make_error(ErrorCode::not_found, "there is no I/O VCPU ", io);
    Thread& thread = threads[io];
    {
        const SpinGuard held(thread.change_lock);
        thread.change = parameters;
    }
    core_of(thread).mail().changes.post(io);
    core_of(thread).call();
    return {};
}

Result<void> MetalBoard::route_interrupts(DeviceClass device, int core, bool allowed) {
    if (core < 0 || core >= core_count())
        return make_error(ErrorCode::invalid_argument, "route_interrupts: no such core");
    return device_interrupts.route(device, core, allowed);
}

Result<void> MetalBoard::core_timer(int core, bool enabled) {
    if (!is_ours(core)) return make_error(ErrorCode::invalid_argument, "core_timer: no such core");
    core_at(core).allow_alarms(enabled);
    core_at(core).call();
    return {};
}

GuaranteeReport MetalBoard::guarantee() const {
    GuaranteeReport report;
    report.board = text<FixedString<64>>(linux_side.exists() ? "beside Linux, " : "no operating system, ",
                                         CoreInterrupts::describe());
    report.memory_locked = true;  // there is no other
    for (const Thread& thread : threads) {
        if (thread.state == ThreadState::unused) continue;
        LoopGuarantee loop{thread.spec};
        loop.used = core_of(thread).charged(thread);
        loop.watched = computer_clock.now() - began_;
        loop.priority_enforced = loop.budget_enforced = true;
        loop.core_owned = thread.spec.owns_core;
        if (const std::uint64_t lost = thread.lost.load(); lost > 0)
            loop.shortfall = text<FixedString<200>>("its queue was full ", lost, " times: that work is lost");
        if (const std::uint32_t paid = thread.paid.load(); paid > 0)
            write(loop.shortfall, loop.shortfall.empty() ? "" : "; ", "it gave its core up ", paid,
                  " times more often than it declares, and its own budget paid for that");
        report.loops.push_back(loop);
        if (!thread.times.empty())
            report.bottom_halves.push_back(thread.times.describe(thread.spec.id, thread.spec.core));
    }
    const double seconds = runs_ ? to_seconds(computer_clock.now() - began_) : 0;
    for (int number = first_core(); number < core_count(); ++number) {
        const CoreCounts& counts = core_at(number).counts();
        const auto came = counts.alarms.load() + counts.devices.load();
        report.cores.push_back(
            {.core = number,
             .interrupts_per_second = seconds > 0 ? static_cast<double>(came) / seconds : 0,
             .tick_stopped = !core_at(number).alarms_allowed(),
             .throttling_lifted = true,
             .note = text<FixedString<200>>(
                 "timer ", counts.alarms.load(), ", devices ", counts.devices.load(),
                 device_interrupts.words_on(number).view(), ", calls of cores ", counts.calls.load(),
                 kernel_note(counts).view(), clock_is_invariant() ? "" : "; its clock may change its rate")});
    }
    return report;
}

}  // namespace qduino::board::metal
