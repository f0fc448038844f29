// Records a run on Linux with the kernel's own tracer, and turns that into a file for
// ui.perfetto.dev.
//
//   tracefs, an instance of our own ──► a line of text for each event ──► KernelTraceReader
//                                                                     ──► Chrome trace
//     sched_switch, sched_wakeup of "loop N", "io N"   stretches on a core, preempt, block, wake
//     sched_process_fork                               which threads are our sketch's
//     signal_deliver of the budget timer               throttle: a sleep between this and the next
//     sys_enter of rt_sigreturn                        one, so in the handler
//     irq_handler_…, local_timer_entry and _exit       interrupts of the cores that loops ran on
//
// The trace lacks what the kernel does not know: where a release begins in a loop that owns its
// core and spins, and overruns. (Formats: Documentation/trace/ftrace.rst and events.rst of Linux;
// "Trace Event Format" of Google.)
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "qduino/trace/traced_picture.h"

namespace qduino::apps {

/// Reads the text of an ftrace buffer, line by line.
class KernelTraceReader {
  public:
    /// `budget_signal`: the number of the signal that ends a budget. `ancestor`: the thread whose
    /// descendants' loops are recorded (there may be other sketches on this computer).
    KernelTraceReader(int budget_signal, int ancestor) : budget_signal_(budget_signal), family_{ancestor} {}

    /// What the lines to come tell goes to `picture`, too, which outlives the reader.
    void draw_into(TracedPicture& picture) { picture_ = &picture; }
    /// One line, without its end. A line that is no event, or none of ours, is skipped.
    void line(std::string_view text);
    /// The trace as JSON, of cores on which a loop has run. Stretches that have not ended end with
    /// the last event.
    [[nodiscard]] std::string chrome_json();
    /// Events that did not fit the kernel's buffer, as its head says.
    [[nodiscard]] std::int64_t lost() const { return lost_; }
    /// Stretches of loops on a core, so far.
    [[nodiscard]] int stretches() const { return stretches_; }

  private:
    struct Event {
        int core = 0;
        std::int64_t us = 0;
        std::string_view fields;
    };
    struct Running {
        int vcpu = 0;
        std::int64_t since_us = 0;
    };
    struct Core {
        Running running;
        std::int64_t interrupt_since_us = -1;
        std::string interrupt;
        bool has_loops = false;
        std::vector<std::string> records;
        std::set<int> vcpus;  // that records name
    };

    void head(std::string_view text);
    void forked(const Event& event);
    [[nodiscard]] int vcpu_of(std::string_view comm, std::string_view pid) const;
    [[nodiscard]] int vcpu_of(std::string_view task) const;
    void switched(const Event& event);
    void tell(const Event& event, int vcpu, picture::Doing doing);
    void woken(const Event& event);
    void signalled(const Event& event, int vcpu);
    void interrupt_begins(const Event& event, std::string_view name);
    void interrupt_ends(const Event& event);
    void end_stretch(int core, std::int64_t us);
    void instant(int core, int vcpu, std::int64_t us, const char* name);
    [[nodiscard]] std::int64_t since_start(std::int64_t us);

    int budget_signal_;
    std::set<int> family_;  // threads
    std::map<int, Core> cores_;
    std::set<int> in_handler_;  // VCPUs whose budget timer has struck, until its handler returns
    std::optional<std::int64_t> start_us_;
    std::int64_t last_us_ = 0;
    std::int64_t lost_ = 0;
    int stretches_ = 0;
    TracedPicture* picture_ = nullptr;
};

/// A tracer of the kernel; it records until it is destroyed.
class KernelTracer {
  public:
    /// Begins to record. Error: not_permitted (root only), not_found (no tracefs), with what to do.
    static Result<KernelTracer> start();
    KernelTracer(KernelTracer&& other) noexcept : instance_(std::move(other.instance_)) {
        other.instance_.clear();
    }
    KernelTracer& operator=(KernelTracer&&) = delete;
    ~KernelTracer();

    /// Stops, and gives what was recorded to `reader`. Error: it cannot be read.
    Result<void> stop(KernelTraceReader& reader);

  private:
    explicit KernelTracer(std::filesystem::path instance) : instance_(std::move(instance)) {}
    Result<void> set_up();
    Result<void> write(const std::string& file, const std::string& text);

    std::filesystem::path instance_;  // a folder in tracefs; empty: moved away
};

}  // namespace qduino::apps
