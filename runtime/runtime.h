// The runtime: turns a sketch's declared loops into admitted, running VCPUs on a board.
//
//   sketch_table() ─► begin(): Plan (admission, cores) ─► setup() ─► board.start()
//                  ─► on each VCPU, until a stop: body(), body(), body() …
//
// Real-time paths (everything that a loop may call, except setup-time functions) allocate nothing
// and lock nothing.
//
// Order of a program: make the board, make the Runtime, begin(), run().
//
// It has more functions than other classes: what a program, a loop and a handler may call are three
// short lists.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "base/result.h"
#include "board/board.h"
#include "runtime/loop.h"
#include "runtime/plan.h"
#include "runtime/sketch.h"

namespace qduino::runtime {

struct RuntimeOptions {
    bool enforce_admission = true;  ///< false: run a sketch that was refused, for experiments
    /// The I/O VCPU of handlers that were attached without one.
    Nanoseconds default_io_budget = 1ms;
    Nanoseconds default_io_period = 100ms;
    /// A loop that waits for its periods hangs when a release lasts so long, and 10 periods at
    /// least; unless the sketch promised otherwise.
    Nanoseconds release_limit = 5s;
    /// Measure the CPU time of each release and each run of a handler: two system calls before it,
    /// and two behind.
    bool profile = false;
    /// Measure how long each lock is held: two system calls for each time, where the board needs
    /// any.
    bool measure_locks = false;
};

class Runtime {
  public:
    /// From now on it is the program's runtime (current()), and `board`, which outlives it, the
    /// program's board.
    explicit Runtime(board::Board& board, RuntimeOptions options = {});
    ~Runtime();
    Runtime(const Runtime&) = delete;
    Runtime& operator=(const Runtime&) = delete;

    /// The runtime that was made last; null when there is none.
    [[nodiscard]] static Runtime* current() { return current_; }

    /// When it was made, on the board's clock: a sketch's millis() count from here.
    [[nodiscard]] Instant made_at() const { return made_at_; }

    // ---- the program: host thread ---------------------------------------------------------------

    /// Runs setup(), admits all that is declared then, starts the loops. Once. Error: the refusal
    /// (explanation() has it at length).
    Result<void> begin(const SketchTable& table) { return begin(table, table.setup); }
    /// The same with another function in the place of the table's setup(); null: it is left out.
    /// setup() may enter loops into the table.
    Result<void> begin(const SketchTable& table, void (*setup)());
    /// Runs the board until `until`, or until the sketch has stopped.
    void run(Instant until) { board_.run(until); }

    [[nodiscard]] const Plan& plan() const { return plan_; }
    [[nodiscard]] const sched::Explanation& explanation() const { return plan_.explanation(); }
    [[nodiscard]] board::Board& board() { return board_; }
    [[nodiscard]] const board::Board& board() const { return board_; }
    /// Null when no loop has this id.
    [[nodiscard]] const Loop* loop(board::VcpuId id) const {
        return id < loops_.size() ? loops_[id].get() : nullptr;
    }

    /// The profile of the handler of `pin`; null: it has none, or no profile was asked for.
    [[nodiscard]] const ExecutionProfile* handler_profile(board::PinId pin) const {
        return pin.number < board::kPinCount ? handlers_[pin.number].profile.get() : nullptr;
    }
    [[nodiscard]] board::VcpuId handler_vcpu(board::PinId pin) const { return handlers_[pin.number].io; }
    /// What was seen so far of the chain at `index` of plan().chains(), and its bound now; null
    /// where it has none. Any thread may read it while the loops run.
    [[nodiscard]] const ChainWatch* chain_watch(std::size_t index) const {
        return index < watches_.size() ? watches_[index].get() : nullptr;
    }

    // ---- called by loops ------------------------------------------------------------------------

    /// Ends this release of the calling loop; returns at the nominal start of the next, never early
    /// (at once under catch_up, or when the loop is late). From setup() and handlers: no effect.
    void wait_for_next_period();
    /// Lets others have the core for a moment: asleep, or, for a loop that owns its core, spinning.
    void yield();
    /// Setup-time, or from the loop itself. Unknown loops are ignored. `handler` may be null.
    void set_overrun_policy(board::VcpuId id, OverrunPolicy policy, OverrunHandler handler);
    /// Loop `id` hangs when for `limit` it has neither begun a release nor called note_progress();
    /// 0 or less: it may take as long as it likes. Setup-time, or from the loop itself. Unknown
    /// loops are ignored.
    void promise_progress(board::VcpuId id, Nanoseconds limit);

    // ---- interrupts -----------------------------------------------------------------------------

    /// In setup(): the I/O VCPU of the bottom halves of `device`. Error: unsupported when the board
    /// cannot serve the device class so.
    /// From a loop or a handler: that I/O VCPU has another budget and period from now on. `core` is
    /// its own, or kAnyCore. Errors: out_of_range when the loops on its core would not be admitted
    /// then, not_found when setup() declared none under this name, not_permitted for another core,
    /// unavailable while another loop makes a change; nothing is changed then.
    Result<void> interrupts_vcpu(board::DeviceClass device, Nanoseconds budget, Nanoseconds period, int core);
    /// `handler` runs on an I/O VCPU of its own, or, with a zero budget, on that of the GPIO class.
    /// Setup-time; later for a handler that setup() has attached to this pin: it may be detached
    /// and come back, at other edges as well. Error: not_permitted for any other then.
    Result<void> attach_interrupt(board::PinId pin, board::Edge edge, void (*handler)(), Nanoseconds budget,
                                  Nanoseconds period, int core);
    /// Error: not_permitted when no loop owns the core; out_of_range when the loops that run would
    /// not be admitted then (nothing is changed).
    Result<void> core_timer(int core, bool enabled);
    /// Routes a device class's interrupts away from `core`, or lets them come there again. Error:
    /// as of core_timer(), and of the board.
    Result<void> route_interrupts(board::DeviceClass device, int core, bool allowed);
    /// False holds back handlers that have not begun; they run when it is true again.
    void global_interrupts(bool enabled) { handlers_held_.store(!enabled, std::memory_order_release); }
    /// The I/O VCPUs that run `handler`.
    [[nodiscard]] FixedVector<board::VcpuId, sched::kIoVcpuLimit> handlers_of(void (*handler)()) const;
    [[nodiscard]] bool handlers_held() const { return handlers_held_.load(std::memory_order_acquire); }
    /// How often handlers have run, all together. It wraps around.
    [[nodiscard]] std::uint32_t handler_runs() const { return handler_runs_.load(std::memory_order_acquire); }

  private:
    struct Handler {
        Runtime* runtime = nullptr;
        void (*function)() = nullptr;
        board::VcpuId io = board::kNoVcpu;
        std::unique_ptr<ExecutionProfile> profile;
        std::vector<ChainPlace> chains;
    };

    void add_sections(const SketchTable& table);
    Loop& loop_at(board::VcpuId id);
    [[nodiscard]] Loop* current_loop();
    Result<void> start_loops();
    Result<void> attach_again(board::PinId pin, board::Edge edge, void (*handler)(), Nanoseconds budget);
    void add_chain(Chain chain);
    void watch_chains();
    void note_chain_bounds();
    void chains_begin(const Loop& loop, Instant now);
    void chains_end(const Loop& loop, Instant now);
    template <typename Change>
    Result<void> one_at_a_time(Change change);
    template <typename Undo>
    Result<void> keep_if_admitted(const char* change, Undo undo);
    Result<void> change_io(board::DeviceClass device, sched::VcpuParameters parameters, int core);
    void keep_handlers_off();
    static void loop_entry(void* context);
    void repeat(Loop& loop);
    [[nodiscard]] Instant origin(Instant now);
    [[nodiscard]] bool is_no_loop(board::VcpuId id) const;
    void promise_by_default(Loop& loop);
    void end_pass(Loop& loop);
    void begin_release(Loop& loop, const Release& release);
    void count_overrun(Loop& loop, const Release& release);
    void wait_until(const Loop& loop, Instant t);
    static void run_handler(void* context);

    static constexpr std::int64_t kNoOrigin = INT64_MIN;
    static constinit Runtime* current_;

    board::Board& board_;
    RuntimeOptions options_;
    Plan plan_;
    std::vector<sched::PlatformOverheads> overheads_;  // by core; a change writes it anew
    Instant made_at_;
    bool begun_ = false;
    std::array<std::unique_ptr<Loop>, board::kMaxLoop + 1> loops_;
    std::array<Handler, board::kPinCount> handlers_{};
    std::vector<std::unique_ptr<ChainWatch>> watches_;
    std::atomic<std::int64_t> origin_ns_{kNoOrigin};
    std::atomic<bool> handlers_held_{false};
    std::atomic<std::uint32_t> handler_runs_{0};
    board::LockWord changing_;  // held by the loop that has its core judged again
    // What was asked for last, a bit for each core: classes routed away from it, and no tick.
    std::array<std::uint64_t, board::kDeviceClassCount> away_{};
    std::uint64_t tickless_ = 0;
    board::VcpuId gpio_io_ = board::kNoVcpu;
    // By the name in interruptsVcpu(); the last is `all`.
    std::array<board::VcpuId, board::kDeviceClassCount + 1> io_of_device_{};
};

}  // namespace qduino::runtime
