// A run of the simulator as a schedule to draw (report/picture).
#pragma once

#include <map>
#include <optional>
#include <string>

#include "board/sim/trace.h"
#include "report/picture/recorder.h"
#include "runtime/runtime.h"

namespace qduino::apps {

/// Hears of everything, and keeps what lies in the window that follow() names.
class ScheduleTrace final : public board::sim::TraceSink {
  public:
    /// From now on it records the loops of `runtime`, which has begun and outlives it, in
    /// [from, until).
    void follow(const runtime::Runtime& runtime, Instant from, Instant until);
    /// What was recorded up to `now`; nothing more is recorded. Contract: it follows a runtime.
    [[nodiscard]] picture::Schedule finish(Instant now);

    void on_event(const board::sim::TraceEvent& event) override;
    void on_budget(Nanoseconds left) override { left_ = left; }
    void on_ready(Instant now, int core, board::VcpuId vcpu) override;
    void on_taken(Instant now, int core, Instant from, Instant until) override;

  private:
    void released(const board::sim::TraceEvent& event);

    struct Cause {
        Instant at = Instant::min();
        std::string what;
    };
    const runtime::Runtime* runtime_ = nullptr;
    std::optional<picture::Recorder> recorder_;
    std::map<int, Cause> causes_;  // by core: what the next stretch is taken for
    Nanoseconds left_ = picture::kUnknown;
};

/// Hands everything on to two sinks, each of which may be null.
class TwoSinks final : public board::sim::TraceSink {
  public:
    TwoSinks(TraceSink* first, TraceSink* second) : first_(first), second_(second) {}
    void on_event(const board::sim::TraceEvent& event) override {
        if (first_) first_->on_event(event);
        if (second_) second_->on_event(event);
    }
    void on_budget(Nanoseconds left) override {
        if (first_) first_->on_budget(left);
        if (second_) second_->on_budget(left);
    }
    void on_ready(Instant now, int core, board::VcpuId vcpu) override {
        if (first_) first_->on_ready(now, core, vcpu);
        if (second_) second_->on_ready(now, core, vcpu);
    }
    void on_taken(Instant now, int core, Instant from, Instant until) override {
        if (first_) first_->on_taken(now, core, from, until);
        if (second_) second_->on_taken(now, core, from, until);
    }

  private:
    TraceSink* first_;
    TraceSink* second_;
};

}  // namespace qduino::apps
