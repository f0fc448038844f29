#include "board/linux/linux_board.h"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "base/contract.h"
#include "board/linux/computer/overheads.h"
#include "board/linux/kernel/core_rivals.h"
#include "board/linux/kernel/held_thread.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/kernel/written_files.h"
#include "board/linux/loop/budget_findings.h"
#include "posix/small_file.h"

namespace qduino::board::linux {
namespace {

/// Tells the core that this is a spin: saves power, and time of the other hyper-thread.
inline void relax_core() {
#if defined(__x86_64__)
    __builtin_ia32_pause();
#elif defined(__aarch64__)
    asm volatile("yield");
#endif
}

/// Below this a pause of the core (up to 140 cycles) would be seen in the result.
constexpr Nanoseconds kTightSpin = 300ns;
/// Time for a look at both clocks, and for another when an interrupt came between.
constexpr Nanoseconds kLongSpin = 10us;
/// Below this three readings of the clock instead of one would be seen in the result.
constexpr Nanoseconds kWorthMeasuring = 300ns;
/// A reading that takes longer was interrupted, or is no reading of the cycle counter.
constexpr Nanoseconds kReadingAtMost = 100ns;
/// Before the end of a long spin: some cache misses, and little enough that what was fetched is
/// still there.
constexpr Nanoseconds kRehearsal = 1500ns;
constexpr Nanoseconds kLookAtDelaysEvery = 1s;

/// For a thread to come up on its core, on a computer with much to do.
constexpr Nanoseconds kComesUpWithin = 10s;

CpuList cores_of_this_process() {
    CpuList list;
    cpu_set_t cores;
    CPU_ZERO(&cores);
    if (::sched_getaffinity(0, sizeof cores, &cores) != 0) return list;
    for (int core = 0; core < std::min(CPU_SETSIZE, CpuList::kLimit); ++core) {
        if (CPU_ISSET(static_cast<std::size_t>(core), &cores)) list.add(core);
    }
    return list;
}

/// How long a loop may compute without a wait. One that has a core spins there for as long as it
/// likes; another may take its budget twice, while it holds a lock.
Nanoseconds longest_computation(std::span<const VcpuSpec> specs) {
    Nanoseconds longest{};
    for (const VcpuSpec& spec : specs)
        longest = std::max(longest, spec.owns_core ? Nanoseconds{1h} : 2 * spec.budget);
    return longest;
}

/// Returns how long after `t` it ended.
Nanoseconds spin_until(Instant t) {
    for (;;) {
        const Nanoseconds left = t - cycle_clock.soon();
        if (left <= Nanoseconds{0}) return -left;
        if (left > kTightSpin) relax_core();
    }
}

}  // namespace

// ---- opening ------------------------------------------------------------------------------------

LinuxBoard::LinuxBoard(LinuxConfig config)
    : config_(std::move(config)), core_count_(cpu_count()), started_on_(cores_of_this_process()) {}

Result<std::unique_ptr<LinuxBoard>> LinuxBoard::open(LinuxConfig config) {
    std::unique_ptr<LinuxBoard> board{new LinuxBoard{std::move(config)}};
    cycle_clock.start();
    wake_on_time();  // also what this thread makes: the warden
    // Before setup(). A process whose parent has died is the sketch's child then, where the warden
    // sees it (strangers.h).
    if (board->config_.enforce_budgets && board->config_.warden) ::prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0);
    QDUINO_TRY(board->pins_.open(board->config_));
    if (VirtualPins& shared = board->pins_.virtual_pins(); shared.attached())
        board->life_ = SignsOfLife{shared, board->config_.heartbeat_bound};
    if (board->config_.handle_signals) {
        board->signals_ = std::make_unique<FatalSignals>(
            Will{[](void* self) { static_cast<LinuxBoard*>(self)->force_safe_states(); },
                 [](void* self) { static_cast<LinuxBoard*>(self)->request_stop(); }, board.get(),
                 board->config_.last_words});
    }
    return board;
}

LinuxBoard::~LinuxBoard() {
    request_stop();
    crew_.join();
    warden_.dismiss();
    force_safe_states();
    witness_.dismiss();
    cores_.give_back();
}

// ---- time ---------------------------------------------------------------------------------------

// The call after a spin must happen at once, and most often it is a write to a pin. But while a
// core spins, others fill its caches (the other hyper-thread, the interrupts): every twentieth
// write then took 0.3 to 1 us, on a noisy host. So the code and data of a write are fetched before.
//
//   ├ rest, if it must ┼ anchor of the clock ┼ pause … ┼ rehearsal ┼ pause … looks ┤ digitalWrite
//                                                  t - 1.5 us         t - 0.3 us   t
void LinuxBoard::busy_until(Instant t) {
    life_.promise(current_vcpu(), t);
    VcpuThread* thread = VcpuThread::current();
    if (thread) thread->rest_before_spin(t);
    const Nanoseconds left = t - cycle_clock.soon();
    if (left > kLongSpin) {
        cycle_clock.keep_fresh();
        static_cast<void>(spin_until(t - kRehearsal));
        if (thread) pins_.virtual_pins().rehearse_write(current_vcpu());
    }
    if (left <= Nanoseconds{0}) return;
    const Nanoseconds late = spin_until(t);
    if (thread && thread->spec().owns_core) thread->was_late(late);
}

// The caller measures from its own reading of the clock before the call to the one after it:
//
//   caller's reading ─ way in ─┬─ begin ─────────── length ──────────┬─ way out ─ caller's reading
//                              └─ one reading of the clock, at least ┘
//
// The ways in and out take one reading of the clock at least, so that much may be left out of the
// spin. How long a reading takes changes from one moment to the next by a factor of eight here
// (what else the processor does); so it is measured in the call. The shorter of two in a row
// counts: what comes between (an interrupt, a line that another core has) comes between one of them
// only.
void LinuxBoard::busy_for(Nanoseconds length) {
    const Instant begin = now();
    if (length < kWorthMeasuring) return busy_until(begin + length);
    const Instant second = now();
    const Instant third = now();
    const Nanoseconds reading = std::min(second - begin, third - second);
    busy_until(begin + length - (reading <= kReadingAtMost ? reading : Nanoseconds{0}));
}

void LinuxBoard::sleep_until(Instant t) {
    life_.promise(current_vcpu(), t);
    VcpuThread* thread = VcpuThread::current();
    if (!thread) return block_until(t);
    thread->sleep_towards(t);
    static_cast<void>(spin_until(t));
}

// ---- pins and buses -----------------------------------------------------------------------------

Result<double> LinuxBoard::chip_temperature() {
    const std::string path = config_.sysfs_root + "/sys/class/thermal/thermal_zone0/temp";
    QDUINO_TRY_ASSIGN(const std::string milli, posix::read_small_file(path));
    return std::strtod(milli.c_str(), nullptr) / 1000;
}

std::uint64_t LinuxBoard::lost_edges() const {
    const VirtualPins& shared = pins_.virtual_pins();
    return shared.attached() ? shared.lost_edges() : 0;
}

// ---- running ------------------------------------------------------------------------------------

Result<void> LinuxBoard::start(std::span<const VcpuSpec> specs) {
    QDUINO_EXPECT(crew_.threads().empty());
    QDUINO_TRY(check_specs(specs, config_, core_count_));
    if (config_.real_time) QDUINO_TRY(lift_real_time_limit(longest_computation(specs)));
    QDUINO_TRY(cores_.lock(specs));
    QDUINO_TRY(open_writers(specs));
    hire_warden(specs);
    if (config_.lock_memory) memory_locked_ = lock_memory().ok();
    cores_.take(specs);
    if (config_.real_time)
        promise_.make(
            specs, [this](int core) { return platform_overheads(core); }, config_.sysfs_root);
    return make_threads(specs);
}

Result<void> LinuxBoard::open_writers(std::span<const VcpuSpec> specs) {
    VirtualPins& shared = pins_.virtual_pins();
    if (!shared.attached()) return {};
    for (const VcpuSpec& spec : specs) {
        QDUINO_TRY(shared.open_writer(spec.id, spec.owns_core));
        shared.publish_place(spec.id, {.core = spec.core, .priority = priority_of(spec, specs, config_)});
    }
    witness_.call(shared.layout().witness, config_.real_time);
    return {};
}

/// The threads inherit that stop signals are blocked. This one has them again before it waits for
/// them.
Result<void> LinuxBoard::fill_crew(std::span<const VcpuSpec> specs) {
    const StopSignalsBlocked for_new_threads;
    if (config_.enforce_budgets && config_.warden) {
        if (auto rules = rules_for_written_files(); rules) written_files_ = std::move(*rules);
    }
    for (const VcpuSpec& spec : specs) {
        if (!spec.entry) QDUINO_TRY(edges_.open(spec.id));
    }
    for (const VcpuSpec& spec : specs) {
        VcpuSpec mine = spec;
        if (!mine.entry) {
            mine.entry = &LinuxBoard::edge_entry;
            mine.context = this;
        }
        VcpuThreadOptions options;
        options.priority = priority_of(spec, specs, config_);
        options.stack_bytes = config_.stack_bytes;
        options.enforce_budget = config_.enforce_budgets && !spec.owns_core;
        if (spec.owns_core) options.spin_share = real_time_share(config_.sysfs_root);
        if (config_.enforce_budgets && config_.warden)
            options.confinement = Confinement{.warden = warden_.pid(), .written_files = written_files_.get()};
        options.isolation = cores_.isolation_of(spec);
        options.life = &life_;
        QDUINO_TRY(crew_.add(mine, options));
    }
    return {};
}

/// A task of higher rank that never waits would keep a thread from its core for ever.
Result<void> LinuxBoard::wait_for_crew() {
    const std::optional<VcpuSpec> missing = crew_.wait_until_ready(kComesUpWithin);
    if (!missing) return {};
    const std::string spinner = who_spins_on(missing->core, ::getpid(), config_.sysfs_root);
    return make_error(ErrorCode::unavailable, "loop ", missing->id, " does not come up on core ",
                      missing->core, ": ", spinner.empty() ? "other tasks leave it no time there" : spinner,
                      spinner.empty() ? "" : " runs there without a pause",
                      ": stop what takes that core, or give the loop another");
}

Result<void> LinuxBoard::make_threads(std::span<const VcpuSpec> specs) {
    QDUINO_TRY(fill_crew(specs));
    QDUINO_TRY(wait_for_crew());
    instruct_warden();
    rank_kernel_threads();
    began_at_ = now();
    delays_.begin(began_at_, loops());
    crew_.go();
    return {};
}

void LinuxBoard::hire_warden(std::span<const VcpuSpec> specs) {
    // The warden ranks above every loop, and below the witness.
    constexpr int kUsualPriority = 88;
    if (!config_.enforce_budgets || !config_.warden || std::ranges::all_of(specs, &VcpuSpec::owns_core))
        return;
    WardenTask task;
    if (config_.real_time) task.priority = std::clamp(config_.priority_highest + 1, kUsualPriority, 98);
    if (overheads_) task.wait = 2 * overheads_->release_cost;
    task.cores = CpuList::first(core_count_);
    for (const VcpuSpec& spec : specs) {
        if (spec.owns_core) task.cores.remove(spec.core);
    }
    VirtualPins& shared = pins_.virtual_pins();
    if (shared.attached()) task.by = &shared.layout().warden_by_ns;
    if (const auto hired = warden_.hire(task); !hired) warden_shortfall_ = hired.error().message.view();
}

void LinuxBoard::instruct_warden() {
    if (warden_.pid() == 0) return;
    FixedVector<Ward, kVcpuLimit> wards;
    for (const auto& thread : crew_.threads()) {
        const VcpuSpec& spec = thread->spec();
        wards.push_back({.id = spec.id,
                         .tid = thread->tid(),
                         .core = spec.core,
                         .priority = thread->priority(),
                         .budget = spec.budget,
                         .period = spec.period,
                         .client_period = spec.client_period,
                         .watched = thread->budget_kept()});
    }
    const bool grows = std::ranges::any_of(crew_.threads(), [](const auto& t) { return t->spec().classic; });
    const auto watching = warden_.watch(wards, cores_.kernel_threads(), witness_.tid(), grows);
    if (!watching) warden_shortfall_ = watching.error().message.view();
    VirtualPins& shared = pins_.virtual_pins();
    if (watching && shared.attached()) shared.layout().warden = static_cast<std::uint32_t>(warden_.pid());
}

/// The warden has done so where it keeps them to a budget.
void LinuxBoard::rank_kernel_threads() {
    for (const KernelThread& thread : cores_.kernel_threads()) {
        const auto io = std::ranges::find_if(crew_.threads(),
                                             [&](const auto& each) { return each->spec().id == thread.io; });
        if (warden_.watches() && (*io)->budget_kept()) continue;
        HeldThread::promote({thread.tid, (*io)->spec().core, thread.priority});
    }
}

void LinuxBoard::edge_entry(void* self) {
    auto& board = *static_cast<LinuxBoard*>(self);
    board.edges_.serve(VcpuThread::current_id(), board.crew_.stop());
}

std::vector<DelayWitness::Ward> LinuxBoard::loops() const {
    std::vector<DelayWitness::Ward> loops;
    for (const auto& thread : crew_.threads()) {
        const VcpuSpec& spec = thread->spec();
        if (spec.is_io()) continue;
        loops.push_back({.id = spec.id,
                         .core = spec.core,
                         .owns_core = spec.owns_core,
                         .tid = thread->tid(),
                         .worst = thread->worst_late(),
                         .worst_lately = thread->take_worst_lately(),
                         .late = thread->late(),
                         .throttled = thread->budget_kept() ? thread->throttled() : -1,
                         .beyond = thread->beyond(),
                         .ordinary = !thread->real_time()});
    }
    return loops;
}

void LinuxBoard::run(Instant until) {
    Instant next_delays = now() + kLookAtDelaysEvery;
    standstill_.begin(::getpid(), ::gettid());
    for (bool ended = false; !ended;) {
        const bool watched = warden_.pid() != 0;
        const Instant look = std::min({until, next_delays, watched ? now() + kWardenSweep : until});
        ended = crew_.wait_until(look, [this] { renew_promise(); });
        standstill_.woke(look, now());
        if (ended) force_safe_states();
        if (ended && ended_at_ == Instant{}) ended_at_ = now();
        if (!ended) look_after_warden();
        if (ended || look == until || now() >= next_delays) {
            delays_.look(now(), loops(), standstill_.take());
            next_delays = now() + kLookAtDelaysEvery;
        }
        if (look == until) return;
    }
}

/// Loops that nobody keeps to their budgets may take the core from all others: they are to end, and
/// have no rank from now on. The supervisor, where there is one, does not wait for that.
void LinuxBoard::look_after_warden() {
    if (!warden_.is_lost() || !watch_lost_.empty()) return;
    watch_lost_ = warden_.lapse();
    for (const auto& thread : crew_.threads()) HeldThread::demote(thread->tid());
    request_stop();
}

void LinuxBoard::abandon() {
    request_stop();
    force_safe_states();
    cores_.give_back();
}

Result<void> LinuxBoard::change_io(VcpuId io, sched::VcpuParameters parameters) {
    const auto thread = std::ranges::find_if(
        crew_.threads(), [&](const auto& each) { return each->spec().is_io() && each->spec().id == io; });
    if (thread == crew_.threads().end()) return make_error(ErrorCode::not_found, "there is no I/O VCPU ", io);
    (*thread)->change(parameters);
    warden_.change(io, parameters);
    crew_.wake();
    return {};
}

std::optional<ServingVcpu> LinuxBoard::serving(DeviceClass device) const {
    const VcpuId io = cores_.server_of(device);
    for (const auto& thread : crew_.threads()) {
        if (io != kNoVcpu && thread->spec().id == io) return ServingVcpu{thread->spec(), thread->priority()};
    }
    return std::nullopt;
}

/// On the thread of run(): it takes a file.
void LinuxBoard::renew_promise() {
    for (const auto& thread : crew_.threads()) {
        if (thread->spec().is_io()) promise_.change(thread->spec().id, thread->parameters());
    }
}

void LinuxBoard::request_stop() {
    crew_.request_stop();
    edges_.ring_all();
}

Incidents LinuxBoard::incidents() {
    rusage usage{};
    ::getrusage(RUSAGE_THREAD, &usage);
    const VcpuThread* thread = VcpuThread::current();
    return {.page_faults = usage.ru_minflt + usage.ru_majflt,
            .preemptions = usage.ru_nivcsw,
            .throttles = thread ? thread->throttled() : 0};
}

// ---- what holds ---------------------------------------------------------------------------------

sched::PlatformOverheads LinuxBoard::platform_overheads(int core) {
    if (!overheads_) overheads_ = measure_overheads();
    sched::PlatformOverheads overheads = *overheads_;
    if (config_.enforce_budgets && config_.warden) {
        if (!warden_looks_) warden_looks_ = warden_looks(overheads.release_cost);
        overheads.add(*warden_looks_);
    }
    if (config_.real_time) {
        keep_for_ordinary_tasks(overheads, config_.sysfs_root);
        const Interference& interrupts = cores_.interference(core);
        if (interrupts.measured) overheads.add(interrupts.counted());
    }
    overheads.below = cores_.neighbours(core).below;
    overheads.priorities =
        config_.real_time ? static_cast<std::size_t>(config_.priority_highest - config_.priority_lowest + 1)
                          : 1;
    return overheads;
}

GuaranteeReport LinuxBoard::guarantee() const {
    GuaranteeReport report;
    const auto& threads = crew_.threads();
    const bool real_time = std::ranges::all_of(threads, [](const auto& t) { return t->real_time(); });
    report.board = real_time ? "linux, SCHED_FIFO" : "linux, best effort";
    report.memory_locked = memory_locked_;
    for (const auto& thread : threads) {
        LoopGuarantee loop = cores_.describe(*thread);
        if (const std::string_view note = edges_.note_of(loop.id); !note.empty())
            write(loop.shortfall, loop.shortfall.empty() ? "" : "; ", note);
        if (thread->pinned() && !started_on_.has(loop.core))
            write(loop.shortfall, loop.shortfall.empty() ? "" : "; ", "moved to core ", loop.core,
                  ", though its program was started on ", started_on_.to_list(), " (taskset)");
        if (thread->budget_kept())
            describe_budget(loop, *thread, warden_, warden_shortfall_, delays_.taken_of(loop.core));
        describe_kernel_threads(loop, cores_.kernel_threads(), warden_);
        report.loops.push_back(loop);
        if (const HandlerTimes* times = edges_.times_of(loop.id);
            times && thread->returned() && !times->empty())
            report.bottom_halves.push_back(times->describe(loop.id, loop.core));
    }
    cores_.describe_cores(report);
    delays_.describe(report);
    describe_watch(report, warden_);
    if (!watch_lost_.empty()) report.watch_lost = watch_lost_;
    if (began_at_ != Instant{})
        report.ran = (ended_at_ == Instant{} ? cycle_clock.now() : ended_at_) - began_at_;
    promise_.describe_trees(report);
    return report;
}

}  // namespace qduino::board::linux
