// The simulated board: virtual time, any number of cores, one runner at a time; the same seed gives the same run.
//
// Every VCPU is a fiber. Its code takes no time; time is what it asks for (busy_until, sleep_until, and what SimConfig says a
// call or an interrupt costs). The event loop in run() goes from instant to instant:
//
//      ┌─────────────► something due now? ── yes ──► physics, interrupts, then each core settles: charge, wake, decide
//      │                     │ no
//      │               a core whose VCPU has been given all the time it asked for? ── yes ──► resume its fiber
//      │                     │ no                                                             │ asks for more
//      │               jump to the next instant at which something is due                     │
//      └─────────────────────┴────────────────────────────────────────────────────────────────┘
//
// The horizon makes it fast. Before a fiber is resumed, the earliest instant at which anything *else* happens is put in
// horizon_ (another core, an interrupt, the end of its budget, a wake-up, the physics, the end of the run). A loop that asks
// for an instant before it cannot be disturbed on the way, so busy_until() is a comparison and a store, without a switch:
//
//      now_ ──►·····························| horizon_
//      core 1  busy_until(t1) t2) t3)…      |           no event loop up to here
//      core 0  (spinning until here) ───────|
//
// Charging is done when the core settles, for the whole stretch at once.
//
// Invariants: now_ never runs backwards; exactly one fiber runs, or none; a VCPU is resumed only on its core, with budget
// (or owning it), not before the instant it asked for. Enforcement is exact: a budget ends at the nanosecond.
//
// Who may call what: board.h. run(), start() and the constructor belong to the host's thread; everything else to VCPUs too.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "board/board.h"
#include "board/peripherals.h"
#include "board/sim/config.h"
#include "board/sim/interrupts.h"
#include "board/sim/sim_core.h"
#include "board/sim/trace.h"
#include "sched/admission.h"

namespace qduino::board::sim {

class SimBoard final : public Board, private PinEdgeSink {
  public:
    /// `peripherals` and `trace` (may be null) outlive the board.
    SimBoard(SimConfig config, Peripherals& peripherals, TraceSink* trace = nullptr);
    ~SimBoard() override;
    SimBoard(const SimBoard&) = delete;
    SimBoard& operator=(const SimBoard&) = delete;

    // ---- time ------------------------------------------------------------------------------------------------
    [[nodiscard]] int core_count() const override { return static_cast<int>(cores_.size()); }
    [[nodiscard]] Instant now() override {
        before_poll(ApiCall::now);
        return now_;
    }
    void busy_until(Instant t) override {
        if (t < horizon_) [[likely]] {
            pass_time_to(t);
        } else {
            busy_through_events(t);
        }
    }
    void busy_for(Nanoseconds length) override { busy_until(now_ + length); }
    /// Consumes `amount` of the calling VCPU's CPU time: unlike busy_until, not until an instant, so that time taken by others
    /// does not count. For tests and models of load.
    void compute(Nanoseconds amount) {
        polls_ = 0;
        consume(amount);
    }
    void sleep_until(Instant t) override {
        if (wake_latency_ > Nanoseconds{0} && t > now_ && t < kForever - wake_latency_) [[unlikely]]
            t += wake_latency_;
        if (t < horizon_ && sleep_is_local_) {
            pass_time_to(t);
        } else {
            sleep_through_events(t);
        }
    }
    [[nodiscard]] VcpuId current_vcpu() const override { return current_ ? current_->spec.id : kNoVcpu; }

    // ---- pins and buses --------------------------------------------------------------------------------------
    [[nodiscard]] Result<void> pin_mode(PinId pin, PinMode mode) override;
    void pin_write(PinId pin, Level level) override {
        charge(ApiCall::pin_write);
        if (pin.number >= kPinCount) return;
        PinState& state = pins_[pin.number];
        state.level = level;
        if (!state.output) return;
        hash_.pin_written(now_, pin, level);
        peripherals_.pin_written(now_, pin, level);
        if (state.watched) [[unlikely]]
            look_at(pin, level);
    }
    /// An output reads back what was written; an input what the outside drives.
    [[nodiscard]] Level pin_read(PinId pin) override;
    [[nodiscard]] Result<void> pwm_write(PinId pin, double duty) override;
    [[nodiscard]] Result<void> pwm_period(PinId pin, Nanoseconds period) override;
    [[nodiscard]] Result<double> analog_read(PinId pin) override;
    [[nodiscard]] Result<void> i2c_transfer(I2cBus bus, I2cAddress address, std::span<const std::uint8_t> out,
                                            std::span<std::uint8_t> in) override;
    [[nodiscard]] Result<void> spi_transfer(SpiBus bus, SpiSettings settings,
                                            std::span<std::uint8_t> data) override;
    [[nodiscard]] Result<void> safe_state(PinId pin, Level level) override;

    // ---- locks: sim_board_locks.cpp ---------------------------------------------------------------------------
    void lock(LockWord& word) override;
    [[nodiscard]] bool try_lock(LockWord& word) override;
    void unlock(LockWord& word) override;

    // ---- interrupts ------------------------------------------------------------------------------------------
    [[nodiscard]] Result<void> attach_edge(PinId pin, Edge edge, EdgeHandler handler, void* context,
                                           VcpuId io) override;
    void detach_edge(PinId pin) override;
    /// Bottom halves of `device` become the work of I/O VCPU `io`; kNoVcpu: they run at once, above every loop.
    Result<void> serve_interrupts(DeviceClass device, VcpuId io) override;
    /// Routes a device class's interrupts away from `core`, to the lowest core that still takes them, and back.
    /// Error: unavailable when no core would take them.
    Result<void> route_interrupts(DeviceClass device, int core, bool allowed) override;
    /// Stops and starts the scheduling tick of `core`. Error: not_permitted when the board runs and no loop owns the core.
    Result<void> core_timer(int core, bool enabled) override;

    // ---- running ---------------------------------------------------------------------------------------------
    /// Gives the board its VCPUs, once. An I/O VCPU without entry runs the handlers and bottom halves given to it.
    [[nodiscard]] Result<void> start(std::span<const VcpuSpec> specs) override;
    /// Everything before `until` happens; then now() == until, unless the board stopped earlier. May be called again
    /// to go on. run(kForever) returns when all entries have, or when nothing can happen any more.
    void run(Instant until) override;
    void request_stop() override;
    [[nodiscard]] bool stop_requested() override {
        before_poll(ApiCall::now);
        return stop_requested_;
    }
    /// All entries have returned, after a stop was requested: the pins are in their safe states.
    [[nodiscard]] bool stopped() const { return stopped_; }
    /// Forces every pin that has a safe state to it, as the supervisor of a real machine would.
    void force_safe_states();
    [[nodiscard]] GuaranteeReport guarantee() const override;
    /// What SimConfig takes of `core`, for admission: context switches, interrupts at their mean rate, the tick.
    [[nodiscard]] sched::PlatformOverheads platform_overheads(int core) override;

    // ---- told by the runtime, which knows of releases --------------------------------------------------------
    void note_release() override { note(TraceKind::release); }
    void note_overrun() override { note(TraceKind::overrun); }
    /// The calling loop's body returned. One that let no time pass since it last did is charged SimConfig::body_cost.
    void note_body_end() override;

    // ---- looking at a run ------------------------------------------------------------------------------------
    /// The core that the calling VCPU runs on; -1 outside of VCPUs.
    [[nodiscard]] int current_core() const { return current_core_ ? current_core_->number() : -1; }
    [[nodiscard]] std::uint64_t trace_hash() const { return hash_.value(); }
    /// CPU time charged to `id` so far. An owning loop is charged for sleep too: its core is nobody else's.
    [[nodiscard]] Nanoseconds cpu_time(VcpuId id) const;
    /// Times that a VCPU's code was entered: what the fast path saves.
    [[nodiscard]] std::uint64_t resumes() const { return resumes_; }
    /// Edges that came while their I/O VCPU's queue was full.
    [[nodiscard]] std::uint64_t lost_edges() const { return lost_edges_; }
    /// Time that top halves and shared bottom halves took from `core`.
    [[nodiscard]] Nanoseconds stolen_time(int core) const {
        return cores_[static_cast<std::size_t>(core)]->stolen_total();
    }

  private:
    struct PinState {
        Level level = Level::low;  // last written
        bool output = false;
        bool watched = false;  // an edge handler is attached
        bool pwm = false;
        bool has_safe_state = false;
        Level safe_level = Level::low;
    };
    struct EdgeWatch {
        Edge edge = Edge::both;
        EdgeHandler handler = nullptr;
        void* context = nullptr;
        VcpuId io = kNoVcpu;
        Level last = Level::low;
    };

    // The fast path: nothing else happens before `t`.
    void pass_time_to(Instant t) {
        if (t <= now_) return;
        now_ = t;
        polls_ = 0;
    }
    void charge(ApiCall call) {
        if (calls_cost_) [[unlikely]]
            consume(config_.costs[call]);
    }
    void before_poll(ApiCall call) {
        charge(call);
        if (++polls_ > poll_limit_) [[unlikely]]
            consume(config_.poll_cost);
    }
    void consume(Nanoseconds cost);
    void busy_through_events(Instant t);
    void sleep_through_events(Instant t);
    void look_at(PinId pin, Level level);

    void pin_edge(Instant now, PinId pin, Level level) override;
    [[nodiscard]] bool stuck(PinId pin, Level* level) const;
    void poll_watched_pins();

    [[nodiscard]] Result<void> check(const VcpuSpec& spec, std::span<const VcpuSpec> all) const;
    [[nodiscard]] std::uint32_t lock_value() const;
    [[nodiscard]] bool take(LockWord& word);
    [[nodiscard]] Vcpu* holder_of(const LockWord& word) const;
    [[nodiscard]] Vcpu* first_waiter_for(const LockWord& word) const;
    [[nodiscard]] bool closes_a_cycle(const LockWord& word) const;
    void count_lock(Vcpu& vcpu, int change);
    void renew_ranks();
    void give_work(VcpuId io, Work work);
    static void vcpu_main(void* vcpu);
    void serve(Vcpu& io);
    void apply_loop_faults(Vcpu& vcpu);
    void note(TraceKind kind);

    [[nodiscard]] Instant next_due() const;
    void process_due();
    void fire_interrupts();
    [[nodiscard]] SimCore* runnable_core();
    void execute(SimCore& core);
    void emit(int core, VcpuId vcpu, TraceKind kind);
    friend class SimCore;  // emits

    // Read by every call of the fast path: kept together.
    Instant now_ = kEpoch;
    Instant horizon_ = kForever;
    bool sleep_is_local_ =
        true;  // no scheduling decision hangs on it: the host, or a loop that owns its core
    bool calls_cost_ = false;
    bool stop_requested_ = false;
    bool stopped_ = false;
    bool started_ = false;
    std::uint32_t polls_ = 0;       // of the time or of a pin at one instant
    std::uint32_t poll_limit_ = 0;  // SimConfig::poll_limit
    Nanoseconds wake_latency_{};    // SimConfig::wake_latency
    TraceHash hash_;
    Vcpu* current_ = nullptr;
    SimCore* current_core_ = nullptr;
    Peripherals& peripherals_;
    std::array<PinState, kPinCount> pins_{};

    SimConfig config_;
    TraceSink* trace_;
    Instant until_ = kForever;
    std::vector<std::unique_ptr<SimCore>> cores_;
    std::array<std::unique_ptr<Vcpu>, kVcpuLimit> vcpus_;
    std::size_t unfinished_ = 0;  // main VCPUs, and I/O VCPUs with an entry of their own
    Interrupts interrupts_;
    std::array<EdgeWatch, kPinCount> watches_{};
    std::array<VcpuId, kDeviceClassCount> served_by_{};
    bool edges_are_reported_ = false;
    Instant next_poll_ = kForever;
    std::uint64_t lost_edges_ = 0;
    std::uint64_t resumes_ = 0;
};

}  // namespace qduino::board::sim
