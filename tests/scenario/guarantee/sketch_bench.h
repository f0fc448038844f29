// A sketch in the simulator, as a program runs it: loops in a table, the runtime, the Arduino face
// bound to it, a trace that is kept.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "board/peripherals.h"
#include "board/sim/sim_board.h"
#include "runtime/runtime.h"
#include "tests/unit/sim/sim_fixture.h"

namespace qduino::guarantee {

using board::VcpuId;
using board::sim::SimBoard;
using board::sim::SimConfig;
using board::sim::TraceKind;
using board::sim::testing::at;
using board::sim::testing::KeptTrace;

/// One sketch, run once. The bodies are lambdas, in place of the functions that a sketch would
/// have; one bench at a time.
class SketchBench {
  public:
    using Body = std::function<void()>;

    explicit SketchBench(board::Peripherals& wires) : wires_(wires) { running = this; }
    SketchBench() : SketchBench(nothing_) {}
    ~SketchBench() {
        runtime_.reset();
        running = nullptr;
    }
    SketchBench(const SketchBench&) = delete;
    SketchBench& operator=(const SketchBench&) = delete;

    void add_loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core, Body body,
                  Nanoseconds sleep = {}) {
        bodies_.at(id) = std::move(body);
        table_.loops.push_back(declaration(id, budget, period, core, kCalls.at(id)));
        table_.loops.back().suspension = sleep;
        table_.loops.back().deferrable = sleep > Nanoseconds{0};
    }
    /// The last loop of that number sleeps in so many pieces.
    void says_sleeps(VcpuId id, int sleeps) {
        runtime::LoopDeclaration& loop = *std::ranges::find(table_.loops, id, &runtime::LoopDeclaration::id);
        loop.sleeps = sleeps;
        loop.says_sleeps = true;
    }
    /// A loop whose body is a sketch's own.
    void add_loop(VcpuId id, Nanoseconds budget, Nanoseconds period, int core, void (*body)()) {
        table_.loops.push_back(declaration(id, budget, period, core, body));
    }
    void set_setup(Body body) {
        bodies_[0] = std::move(body);
        table_.setup = kCalls[0];
    }
    Result<void> begin(SimConfig config = {}, runtime::RuntimeOptions options = {}) {
        return begin(table_, std::move(config), options);
    }
    /// A whole sketch, as it was linked.
    Result<void> begin(const runtime::SketchTable& table, SimConfig config,
                       runtime::RuntimeOptions options = {}) {
        board_ = std::make_unique<SimBoard>(std::move(config), wires_, &trace_);
        runtime_ = std::make_unique<runtime::Runtime>(*board_, options);
        return runtime_->begin(table);
    }
    void run(Nanoseconds until) { runtime_->run(at(until)); }

    SimBoard& board() { return *board_; }
    const runtime::Runtime& runtime() { return *runtime_; }
    const runtime::LoopStatistics& statistics(VcpuId id) { return runtime_->loop(id)->statistics; }
    const KeptTrace& trace() { return trace_; }

  private:
    static runtime::LoopDeclaration declaration(VcpuId id, Nanoseconds budget, Nanoseconds period, int core,
                                                void (*body)()) {
        runtime::LoopDeclaration declared;
        declared.id = id;
        declared.budget = budget;
        declared.period = period;
        declared.core = core;
        declared.body = body;
        declared.file = "scenario.ino";
        declared.line = id;
        return declared;
    }
    template <int Id>
    static void call() {
        running->bodies_[Id]();
    }
    static constexpr std::array<void (*)(), 5> kCalls{&call<0>, &call<1>, &call<2>, &call<3>, &call<4>};
    static inline SketchBench* running = nullptr;

    board::NoPeripherals nothing_;
    board::Peripherals& wires_;
    KeptTrace trace_;
    runtime::SketchTable table_;
    std::array<Body, 5> bodies_;
    std::unique_ptr<SimBoard> board_;
    std::unique_ptr<runtime::Runtime> runtime_;
};

/// The most time that `bursts` (in order, apart from each other) take of any window of this length.
/// It is enough to look at the windows that begin where a burst begins: moving a window's begin to
/// the right, up to there, loses nothing.
inline Nanoseconds most_in_a_window(const std::vector<KeptTrace::Burst>& bursts, Nanoseconds window) {
    Nanoseconds most{0};
    for (std::size_t first = 0; first < bursts.size(); ++first) {
        const Instant end = bursts[first].begin + window;
        Nanoseconds taken{0};
        for (std::size_t i = first; i < bursts.size() && bursts[i].begin < end; ++i)
            taken += std::min(bursts[i].end, end) - bursts[i].begin;
        most = std::max(most, taken);
    }
    return most;
}

}  // namespace qduino::guarantee
