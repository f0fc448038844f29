// The runtime: turns a sketch's declared loops into admitted, running VCPUs on a board.
//
//   sketch_table() ─► begin(): Plan (admission, cores) ─► setup() ─► board.start() ─► on each VCPU:
//                                                                     until a stop: body(), body(), body() …
//
// One class for every board, chosen by the program's composition root (bind.h). Real-time paths (everything that a loop may
// call, but for setup-time functions) allocate nothing and lock nothing.
//
// Order of a program: make the board, make the Runtime, bind it (so that setup() can reach its pins), begin(), run().
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/contract.h"
#include "base/result.h"
#include "board/board.h"
#include "runtime/board_hooks.h"
#include "runtime/loop.h"
#include "runtime/plan.h"
#include "runtime/sketch.h"

namespace qduino::runtime {

struct RuntimeOptions {
    bool enforce_admission = true;  ///< false: run a sketch that was refused, for experiments
    /// The I/O VCPU of handlers that were attached without one.
    Nanoseconds default_io_budget = 1ms;
    Nanoseconds default_io_period = 100ms;
};

template <board::Board Board>
class Runtime {
  public:
    /// `board` outlives the runtime.
    explicit Runtime(Board& board, RuntimeOptions options = {})
        : board_(board), options_(options), plan_(overheads_of(board), options.enforce_admission) {}
    Runtime(const Runtime&) = delete;
    Runtime& operator=(const Runtime&) = delete;

    // ---- the program: host thread ----------------------------------------------------------------------------

    /// Admits the loops, runs setup(), starts the loops. Once. Error: the refusal (explanation() has it at length);
    /// setup() has not run when the loops themselves are refused.
    Result<void> begin(const SketchTable& table) {
        QDUINO_EXPECT(!begun_);
        if (Result<void> admitted = plan_.add_loops(table); !admitted) return admitted;
        for (const LoopDeclaration& declaration : table.loops)
            loop_at(declaration.id).declaration = declaration;
        if (table.setup) table.setup();
        begun_ = true;
        return start_loops();
    }
    /// Runs the board until `until`, or until the sketch has stopped.
    void run(Instant until) { board_.run(until); }

    [[nodiscard]] const Plan& plan() const { return plan_; }
    [[nodiscard]] const sched::Explanation& explanation() const { return plan_.explanation(); }
    [[nodiscard]] Board& board() { return board_; }
    /// Null when no loop has this id.
    [[nodiscard]] const Loop* loop(board::VcpuId id) const {
        return id < loops_.size() ? loops_[id].get() : nullptr;
    }

    // ---- called by loops ---------------------------------------------------------------------------------------

    /// Ends this release of the calling loop; returns at the nominal start of the next, never early (at once under
    /// catch_up, or when the loop is late). From setup() and handlers: no effect.
    void wait_for_next_period() {
        Loop* loop = current_loop();
        if (!loop) return;
        const Instant ended = board_.now();
        record_latency(*loop);
        const Release release = loop->clock.next(ended, loop->policy);
        if (release.overrun()) count_overrun(*loop, release);
        if (release.nominal > ended) wait_until(*loop, release.nominal);
        loop->waited = true;
        begin_release(*loop, release);
    }
    /// Lets others have the core for a moment: asleep, or, for a loop that owns its core, spinning.
    void yield() {
        const Loop* loop = current_loop();
        if (loop && loop->owns_core) {
            board_.busy_until(board_.now() + 1us);
        } else {
            board_.sleep_until(board_.now() + 20us);
        }
    }
    /// Setup-time, or from the loop itself. Unknown loops are ignored. `handler` may be null.
    void set_overrun_policy(board::VcpuId id, OverrunPolicy policy, OverrunHandler handler) {
        if (id < 1 || id > board::kMaxLoop || (begun_ && !loops_[id])) return;
        loop_at(id).policy = policy;
        loop_at(id).on_overrun = handler;
    }

    // ---- interrupts --------------------------------------------------------------------------------------------

    /// Setup-time. Error: the refusal; unsupported when the board cannot serve the device class so.
    Result<void> interrupts_vcpu(board::DeviceClass device, Nanoseconds budget, Nanoseconds period,
                                 int core) {
        if (begun_) return too_late("interruptsVcpu");
        const Result<board::VcpuId> io = plan_.add_io(budget, period, core);
        if (!io) return io.error();
        if (device == board::DeviceClass::gpio || device == board::DeviceClass::all) gpio_io_ = io.value();
        if (device == board::DeviceClass::gpio) return {};  // its bottom halves are the attached handlers
        Result<void> served = hooks::serve_interrupts(board_, device, io.value());
        if (!served) plan_.remove_io(io.value());
        return served;
    }
    /// Setup-time. `handler` runs on an I/O VCPU of its own, or, with a zero budget, on that of the GPIO class.
    Result<void> attach_interrupt(board::PinId pin, board::Edge edge, void (*handler)(), Nanoseconds budget,
                                  Nanoseconds period, int core) {
        if (begun_) return too_late("attachInterrupt");
        if (pin.number >= board::kPinCount || !handler) {
            return make_error(ErrorCode::invalid_argument, "attachInterrupt: no such pin, or no handler");
        }
        const bool own = budget > Nanoseconds{0};
        if (!own && gpio_io_ == board::kNoVcpu) {
            const Result<board::VcpuId> io =
                plan_.add_io(options_.default_io_budget, options_.default_io_period, core);
            if (!io) return io.error();
            gpio_io_ = io.value();
        }
        const Result<board::VcpuId> io =
            own ? plan_.add_io(budget, period, core) : Result<board::VcpuId>(gpio_io_);
        if (!io) return io.error();
        handlers_[pin.number] = {.runtime = this, .function = handler};
        return board_.attach_edge(pin, edge, &Runtime::run_handler, &handlers_[pin.number], io.value());
    }
    void detach_interrupt(board::PinId pin) { board_.detach_edge(pin); }
    Result<void> route_interrupts(board::DeviceClass device, int core, bool allowed) {
        return hooks::route_interrupts(board_, device, core, allowed);
    }
    /// Error: not_permitted when no loop owns the core.
    Result<void> core_timer(int core, bool enabled) {
        if (!enabled && plan_.owner_of(core) == board::kNoVcpu) {
            return make_error(ErrorCode::not_permitted,
                              "noTimer: no loop owns this core; declare one there with budget == period");
        }
        return hooks::core_timer(board_, core, enabled);
    }
    /// False holds back handlers that have not begun; they run when it is true again.
    void global_interrupts(bool enabled) { handlers_held_.store(!enabled, std::memory_order_release); }

  private:
    struct Handler {
        Runtime* runtime = nullptr;
        void (*function)() = nullptr;
    };
    struct Entry {
        Runtime* runtime = nullptr;
        Loop* loop = nullptr;
    };

    static std::vector<sched::PlatformOverheads> overheads_of(Board& board) {
        std::vector<sched::PlatformOverheads> overheads;
        for (int core = 0; core < board.core_count(); ++core) {
            overheads.push_back(hooks::platform_overheads(board, core));
        }
        return overheads;
    }
    static Error too_late(const char* call) {
        Error error = make_error(ErrorCode::not_permitted, call);
        error.message.append(": only in setup(), before the loops are admitted and run");
        return error;
    }

    /// Made when first named, which may be before its declaration is read (policies are set in setup()).
    Loop& loop_at(board::VcpuId id) {
        if (!loops_[id]) loops_[id] = std::make_unique<Loop>();
        return *loops_[id];
    }
    [[nodiscard]] Loop* current_loop() {
        const board::VcpuId id = board_.current_vcpu();
        return id <= board::kMaxLoop ? loops_[id].get() : nullptr;
    }

    Result<void> start_loops() {
        std::vector<board::VcpuSpec> specs = plan_.specs();
        for (board::VcpuSpec& spec : specs) {
            if (spec.kind == board::VcpuKind::io)
                continue;  // without an entry the board runs what is attached to it
            Loop& loop = loop_at(spec.id);
            loop.owns_core = spec.owns_core;
            spec.classic = loop.declaration.classic;
            entries_[spec.id] = {.runtime = this, .loop = &loop};
            spec.entry = &Runtime::loop_entry;
            spec.context = &entries_[spec.id];
        }
        return board_.start(specs);
    }

    static void loop_entry(void* context) {
        const Entry& entry = *static_cast<Entry*>(context);
        entry.runtime->repeat(*entry.loop);
    }

    void repeat(Loop& loop) {
        const Instant now = board_.now();
        loop.clock = ReleaseClock(origin(now), loop.declaration.period, now);
        begin_release(loop, {.nominal = loop.clock.nominal()});
        while (!board_.stop_requested()) {
            loop.waited = false;
            loop.statistics.passes.add(1);
            loop.declaration.body();
            record_latency(loop);
            if (!loop.waited) hooks::note_body_end(board_);
        }
    }

    /// The instant that all loops count their releases from: when the first of them came up.
    Instant origin(Instant now) {
        std::int64_t unset = kNoOrigin;
        origin_ns_.compare_exchange_strong(unset, to_ns(now));
        return instant_from_ns(origin_ns_.load());
    }

    void begin_release(Loop& loop, const Release& release) {
        loop.latency = board_.now() - release.nominal;
        if (!release.overrun() || loop.policy != OverrunPolicy::keep_phase) loop.statistics.releases.add(1);
        hooks::note_release(board_);
    }

    /// Of the release in hand, at its end: the way to its first instruction is kept short. Once for each release.
    void record_latency(Loop& loop) {
        if (loop.latency < Nanoseconds{0}) return;
        loop.statistics.release_latency_ns.record(loop.latency.count());
        loop.latency = Loop::kRecorded;
    }

    void count_overrun(Loop& loop, const Release& release) {
        loop.statistics.overruns.add(1);
        loop.statistics.dropped.add(release.dropped);
        loop.statistics.lateness_ns_max.raise_to(release.lateness.count());
        hooks::note_overrun(board_);
        if (loop.policy == OverrunPolicy::stop) board_.request_stop();
        if (loop.policy == OverrunPolicy::call_back && loop.on_overrun) {
            loop.on_overrun(loop.declaration.id, release.lateness);
        }
    }

    /// An owning loop spins through the end of its wait: nobody else wants its core, and a wake-up would make it late.
    void wait_until(const Loop& loop, Instant t) {
        if (!loop.owns_core) return board_.sleep_until(t);
        if (t - board_.now() > 2 * kSpinMargin) board_.sleep_until(t - kSpinMargin);
        board_.busy_until(t);
    }

    static void run_handler(void* context) {
        const Handler& handler = *static_cast<Handler*>(context);
        Board& board = handler.runtime->board_;
        while (handler.runtime->handlers_held_.load(std::memory_order_acquire) && !board.stop_requested()) {
            board.sleep_until(board.now() + kHeldRetry);
        }
        handler.function();
    }

    static constexpr Nanoseconds kSpinMargin = 1ms;
    static constexpr Nanoseconds kHeldRetry = 20us;
    static constexpr std::int64_t kNoOrigin = INT64_MIN;

    Board& board_;
    RuntimeOptions options_;
    Plan plan_;
    bool begun_ = false;
    std::array<std::unique_ptr<Loop>, board::kMaxLoop + 1> loops_;
    std::array<Entry, board::kMaxLoop + 1> entries_{};
    std::array<Handler, board::kPinCount> handlers_{};
    std::atomic<std::int64_t> origin_ns_{kNoOrigin};
    std::atomic<bool> handlers_held_{false};
    board::VcpuId gpio_io_ = board::kNoVcpu;
};

}  // namespace qduino::runtime
