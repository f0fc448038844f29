// Keeps the run: begins the next job's copy, gives it to the machine, and records how it ended
// (run.h decides).
//
//   nothing ── begin ──► run: durable, then its bytes ── outcome ──► ended: durable
//      ▲                                                               │ the inspector's report
//      └───────────────────────────────────────────────────────────────┘
//
// Invariants: at most one run is active. A run is durable before its first byte crosses the link.
// The next run begins only after the outcome of the last one is durable and its inspection is over.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"
#include "spool/feeder.h"
#include "spool/inspector.h"
#include "spool/ledger.h"
#include "spool/machine_link.h"
#include "spool/run.h"
#include "spool/spool_options.h"

namespace qduino::spool {

class RunKeeper {
  public:
    /// All outlive this; `inspector` may be null.
    RunKeeper(const SpoolOptions& options, Ledger& ledger, MachineLink& machine, Inspector* inspector)
        : options_(options), ledger_(ledger), machine_(machine), inspector_(inspector) {}

    /// Takes over what the store knows of runs.
    void load(const StoredState& state);
    /// After MachineLink::read(). `may_begin`: nobody but the queue wants the printer.
    void tick(Instant now, UnixSeconds now_s, bool may_begin);
    /// The link has gone, and what was sent on it.
    void forget_link() { feeder_.reset(); }

    [[nodiscard]] const std::optional<Run>& active() const { return run_; }
    /// A run is active, or its report is awaited.
    [[nodiscard]] bool busy() const { return run_ || awaited_report_; }

    // The spool's calls of these names come here.
    [[nodiscard]] Result<void> pause();
    [[nodiscard]] Result<void> resume();
    [[nodiscard]] Result<void> cancel();

  private:
    void note_place();
    void tell_typed_objects();
    void advance(Instant now, UnixSeconds now_s);
    void feed(const RunAction& action, Instant now, UnixSeconds now_s);
    void repeat_cancel(Instant now);
    void finish(CopyOutcome outcome, const std::string& reason, UnixSeconds now_s);
    void await_report();
    [[nodiscard]] bool is_next_due();
    void begin_next(UnixSeconds now_s);

    const SpoolOptions& options_;
    Ledger& ledger_;
    MachineLink& machine_;
    Inspector* inspector_;
    std::optional<Run> run_;
    std::optional<Run> awaited_report_;
    std::uint64_t last_run_id_ = 0;
    CopyEnd place_;                 // how far the active run is, as the machine last said
    std::uint32_t typed_told_ = 0;  // lines of the run that the inspector knows
    std::optional<Feeder> feeder_;
    std::optional<Instant> cancel_sent_at_;
    bool pause_wanted_ = false;  // asked for before the machine had begun the job
};

}  // namespace qduino::spool
