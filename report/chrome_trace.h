// A run of the simulator as a file for chrome://tracing and ui.perfetto.dev.
//
// Format: "Trace Event Format" (Google, JSON array form). A core is a process; each VCPU is a
// thread in it, and its interrupts are another. A stretch on the CPU is a complete event ("X"),
// everything else an instant ("i"). Times are microseconds with three decimals: the nanosecond is
// kept.
#pragma once

#include <array>
#include <cstdio>
#include <memory>
#include <set>
#include <string>

#include "base/result.h"
#include "board/sim/trace.h"

namespace qduino::apps {

class ChromeTrace final : public board::sim::TraceSink {
  public:
    /// Error: the file cannot be made.
    static Result<std::unique_ptr<ChromeTrace>> create(const std::string& path);
    /// Closes the file; stretches that ran then are left open-ended.
    ~ChromeTrace() override;

    void on_event(const board::sim::TraceEvent& event) override;
    /// Ends the stretches that are running, at `now`, and closes the file. Error: it could not be
    /// written whole.
    Result<void> finish(Instant now);

  private:
    explicit ChromeTrace(std::FILE* file) : file_(file) {}
    void name_thread(const board::sim::TraceEvent& event);
    void end_stretch(int core, Instant now);
    void add(const std::string& record);

    std::FILE* file_;
    bool first_ = true;
    struct Running {
        board::VcpuId vcpu = board::kNoVcpu;
        Instant since;
    };
    std::array<Running, 64> running_{};    // per core
    std::set<std::pair<int, int>> named_;  // cores and their threads
};

}  // namespace qduino::apps
