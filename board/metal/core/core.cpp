#include "board/metal/core/core.h"

#include <algorithm>

#include "base/contract.h"
#include "board/metal/computer/clock.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/core/device_interrupts.h"
#include "board/metal/core/locks.h"
#include "board/metal/library/thread_locals.h"
#include "board/metal/panic.h"

extern "C" qduino::board::metal::Frame* enter_kernel(const qduino::board::metal::Frame* frame) {
    return qduino::board::metal::this_core().enter(*frame);
}

namespace qduino::board::metal {
namespace {

void idle(void*) {
    for (;;) wait_for_interrupt();
}

}  // namespace

// ---- set up -------------------------------------------------------------------------------------

void Core::open(int number, bool host) {
    number_ = number;
    processor_.open(this);
    for (Context* context : {&host_.context, &idle_.context}) context->thread_locals = make_thread_locals();
    idle_.context.begin(&idle, nullptr, boot_stack_top());
    host_.exists = host_.runs = host;
    turn_to(host ? host_.context : idle_.context, nullptr);
}

bool Core::add(Thread& thread, Nanoseconds turn, Instant now) {
    const VcpuSpec& spec = thread.spec;
    const bool added =
        spec.is_io() ? scheduler_.add_io(
                           spec.id, spec.parameters(), now,
                           {.activation = turn, .client_period = spec.client_period, .overrun = spec.overrun})
                     : scheduler_.add(spec.id, spec.parameters(), now,
                                      {.owns_core = spec.owns_core, .deferrable = spec.deferrable});
    if (!added) return false;
    threads_[spec.id] = &thread;
    ++thread_count_;
    turn_ = turn;
    return true;
}

void Core::begin_threads() {
    for (auto* count : {&counts_.alarms, &counts_.devices, &counts_.calls, &counts_.ends}) count->store(0);
    threads_began_.store(true, std::memory_order_release);
    call();
}

// ---- what came ----------------------------------------------------------------------------------

Frame* Core::enter(const Frame& frame) {
    if (frame.vector < kExceptions) panic(frame);
    const Instant came = computer_clock.now();
    if (runs_threads()) charge(came);
    inside_ = true;
    serve(frame, came);
    Context& next = choose(came);
    inside_ = false;
    return &next.frame();
}

/// What the interrupted thread has used; and whether that was the end of its budget.
void Core::charge(Instant came) {
    if (!running_ || running_->state != ThreadState::ready || running_->spec.owns_core || came < until_)
        return scheduler_.account(came);
    const Nanoseconds allowed = charged(*running_) + scheduler_.available(running_->spec.id, came);
    scheduler_.account(came);
    const Nanoseconds overrun = charged(*running_) - allowed;
    if (overrun < Nanoseconds{0}) return;  // an alarm for another one
    counts_.ends.fetch_add(1, std::memory_order_relaxed);
    counts_.worst_overrun.store(std::max(counts_.worst_overrun.load(), overrun));
    const VcpuSpec& spec = running_->spec;
    if (!spec.is_io() && !running_->turns.counts_pause(spec, scheduler_.next_replenishment(spec.id)))
        pay(*running_, came);
}

/// A turn to it that no R has. Alone on its core it displaces nothing.
void Core::pay(Thread& thread, Instant now) {
    if (thread_count_ < 2 || thread.spec.owns_core) return;
    scheduler_.charge(thread.spec.id, turn_, now);
    thread.paid.fetch_add(1, std::memory_order_relaxed);
}

void Core::serve(const Frame& frame, Instant now) {
    const std::uint64_t vector = frame.vector;
    if (vector == kSwitchVector || vector == kSpuriousVector) return;
    if (vector == kTimerVector) {
        counts_.alarms.fetch_add(1, std::memory_order_relaxed);
        if (device_interrupts.next_turn(number_) <= now) device_interrupts.serve_turns(number_, now);
    } else if (vector == kCallVector) {
        counts_.calls.fetch_add(1, std::memory_order_relaxed);
    } else {
        counts_.devices.fetch_add(1, std::memory_order_relaxed);
        device_interrupts.serve(static_cast<std::size_t>(vector - kDeviceVectors), now);
    }
    CoreInterrupts::end_of_interrupt(frame);
}

// ---- who goes on --------------------------------------------------------------------------------

Context& Core::choose(Instant came) {
    if (!runs_threads()) return *current_;
    const Instant now = computer_clock.now();
    scheduler_.account(now, now - came);
    open_mail(now);
    const Instant next_wake = wake_sleepers(now);
    if (host_is_due(now)) {
        host_.runs = true;
        host_.since = now;
        CoreInterrupts::set_alarm(kForever);
        turn_to(host_.context, nullptr);
    } else {
        go_on(scheduler_.decide(now), now, next_wake);
        count_pass(computer_clock.now() - came);
    }
    return *current_;
}

/// Turns to the thread that was chosen at `now`. Its budget begins when the kernel ends.
void Core::go_on(const sched::Decision& decision, Instant now, Instant next_wake) {
    Thread* const thread = decision.vcpu ? threads_[*decision.vcpu] : nullptr;
    const Nanoseconds left = thread ? scheduler_.available(thread->spec.id, now) : Nanoseconds{0};
    const bool ends_by_budget = thread && !thread->spec.owns_core && decision.until == now + left;
    const Instant next_turn = device_interrupts.next_turn(number_);
    turn_to(thread ? thread->context : idle_.context, thread);
    const Instant end = computer_clock.now();
    scheduler_.account(end, end - now);
    until_ = ends_by_budget ? end + left : decision.until;
    const Instant own = alarms_allowed() ? std::min({until_, next_wake, next_turn}) : kForever;
    CoreInterrupts::set_alarm(std::min(own, host_.until));
}

void Core::count_pass(Nanoseconds length) {
    counts_.passes.fetch_add(1, std::memory_order_relaxed);
    counts_.kernel.store(counts_.kernel.load(std::memory_order_relaxed) + length, std::memory_order_relaxed);
}

bool Core::host_is_due(Instant now) {
    if (!host_.exists) return false;
    const bool called = mail_.host.exchange(false);
    if (!called && now < host_.until) return false;
    host_.until = kForever;
    return true;
}

void Core::turn_to(Context& next, Thread* thread) {
    running_ = thread;
    if (current_ == &next) return;
    current_ = &next;
    processor_.go_on_with(next.kernel_stack_top(), next.thread_locals);
}

void Core::open_mail(Instant now) {
    mail_.work.take_all([&](VcpuId io) {
        Thread* const thread = threads_[io];
        if (thread && thread->state == ThreadState::idle) wake(*thread, now);
    });
    mail_.locks.take_all([&](VcpuId id) {
        Thread& thread = *threads_[id];
        thread.state = ThreadState::ready;
        if (!thread.turns.counts_wait()) pay(thread, now);
        scheduler_.wait_for_lock(id, false, now);
    });
    mail_.ranks.take_all([&](VcpuId id) { scheduler_.inherit(id, locks.inherited_by(*threads_[id])); });
    mail_.changes.take_all([&](VcpuId io) {
        Thread& thread = *threads_[io];
        const SpinGuard held(thread.change_lock);
        scheduler_.change_io(io, thread.change, now);
        thread.spec.budget = thread.change.budget;
        thread.spec.period = thread.change.period;
    });
}

/// Returns when the next one is to wake.
Instant Core::wake_sleepers(Instant now) {
    Instant next = kForever;
    for (Thread* thread : threads_) {
        if (!thread || thread->state != ThreadState::sleeping) continue;
        if (thread->wake <= now)
            wake(*thread, now);
        else
            next = std::min(next, thread->wake);
    }
    return next;
}

void Core::wake(Thread& thread, Instant now) {
    const Instant due = std::min(thread.wake, now);
    thread.state = ThreadState::ready;
    thread.wake = kForever;
    // A bottom half's service has its activation in it.
    if (!thread.spec.is_io() && !thread.turns.counts_wake(thread.spec, due)) pay(thread, now);
    scheduler_.wake(thread.spec.id, now, due);
}

// ---- the running thread -------------------------------------------------------------------------

void Core::give_up(ThreadState state, Instant wake) {
    QDUINO_EXPECT(running_ != nullptr);
    running_->state = state;
    running_->wake = wake;
    scheduler_.block(running_->spec.id, computer_clock.now());
    look_up();
}

void Core::wait_for_lock() {
    running_->state = ThreadState::waiting;
    scheduler_.wait_for_lock(running_->spec.id, true, computer_clock.now());
    look_up();
}

void Core::finish() {
    give_up(ThreadState::finished, kForever);
    contract_broken("a thread that has ended runs on", __FILE__, __LINE__);
}

void Core::release(Instant nominal) {
    running_->turns.release(running_->spec, running_->spec.requests);
    scheduler_.release(running_->spec.id, nominal, computer_clock.now());
}

Nanoseconds Core::cpu_time() {
    scheduler_.account(computer_clock.now());
    return scheduler_.consumed(running_->spec.id);
}

// ---- the host -----------------------------------------------------------------------------------

void Core::let_threads_run(Instant until) {
    const InterruptsOff off;
    const Instant now = computer_clock.now();
    scheduler_.account(now, now - std::max(host_.since, kEpoch));
    host_.until = until;
    host_.runs = false;
    look_up();
}

void Core::call_host() {
    mail_.host.store(true);
    call();
}

void Core::call() {
    // At its end enter() looks into the mail anyway.
    if (this == &this_core() && inside_) return;
    CoreInterrupts::interrupt_core(target_, kCallVector);
}

}  // namespace qduino::board::metal
