// The spool: jobs in, copies out. It wires its parts: the ledger (queue, gate, store), the run
// keeper, the serial host's claim, the link to the machine, and the housekeeping. It needs no
// system: what it keeps its jobs in is a Storage, on a disk or in memory.
//
//          add, patch, start …                 tick, 50 times a second
//                │                                   │
//                ▼                                   ▼
//   Queue ── plan ──► Ledger.commit          read the machine → decide(run)
//            Store.commit └─► apply            → feed | record the outcome | begin
//
// It all runs on one thread, "the spool's thread", which may block on the disk. A caller that must
// not wait (the web's I/O thread, an emergency stop) does not call it directly. EmergencyLine is
// the one exception, and thread-safe.
//
// Invariant: what a call reported as done is durable.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/analyzer.h"
#include "spool/host_keeper.h"
#include "spool/housekeeping.h"
#include "spool/inspector.h"
#include "spool/job_page.h"
#include "spool/ledger.h"
#include "spool/link_source.h"
#include "spool/machine_link.h"
#include "spool/run_keeper.h"
#include "spool/spool_options.h"
#include "spool/storage.h"

namespace qduino::spool {

/// An uploader's wishes.
struct NewJob {
    std::string name;
    int copies = 1;
    int priority = 0;
    bool hold = false;
};

class Spool {
  public:
    /// `link` and `inspector` (may be null) outlive the spool. Errors: as Storage::load.
    [[nodiscard]] static Result<std::unique_ptr<Spool>> open(SpoolOptions options,
                                                             std::unique_ptr<Storage> storage,
                                                             LinkSource& link, Inspector* inspector);
    /// The emergency line is cut before anything else.
    ~Spool() { machine_.detach(); }

    // ---- jobs -----------------------------------------------------------------------------------
    /// Makes a job of a sealed and analyzed file: durable when this returns. Errors:
    /// invalid_argument, unavailable (disk or store full).
    [[nodiscard]] Result<JobId> add(StagedFile& file, const Analysis& analysis, const NewJob& wanted,
                                    UnixSeconds now_s);
    [[nodiscard]] Result<void> patch(JobId id, const JobPatch& patch);
    [[nodiscard]] Result<void> remove(JobId id);
    [[nodiscard]] Result<void> start(JobId id);
    /// The jobs that wait or print.
    [[nodiscard]] const Queue& queue() const { return ledger_.queue(); }
    /// Any job; nothing when no job has this number.
    [[nodiscard]] std::optional<Job> find(JobId id) const;
    /// page_of() what there is.
    [[nodiscard]] Result<JobPage> page(const JobQuery& query) const {
        return page_of(ledger_.queue(), ledger_.store(), query);
    }
    [[nodiscard]] JobCounts counts() const { return ledger_.store().counts(); }
    [[nodiscard]] bool confirms_bed() const { return options_.confirm_bed; }
    [[nodiscard]] Files& files() const { return ledger_.files(); }
    [[nodiscard]] Store& store() const { return ledger_.store(); }
    [[nodiscard]] const Storage& storage() const { return *storage_; }
    /// Deletes the job that ended first, with its files. Error: unavailable (there is none), and as
    /// Store::commit.
    [[nodiscard]] Result<void> erase_oldest() { return house_.erase_oldest(); }
    /// Grows whenever the jobs or the gate change.
    [[nodiscard]] std::uint64_t revision() const { return ledger_.revision(); }

    // ---- what printing waits for ----------------------------------------------------------------
    [[nodiscard]] const QueueGate& gate() const { return ledger_.gate(); }
    [[nodiscard]] Result<void> hold_queue(std::string reason) {
        return ledger_.hold_queue(reason.empty() ? "held" : std::move(reason));
    }
    /// Error: not_permitted, while a serial host has the printer.
    [[nodiscard]] Result<void> release_queue();
    [[nodiscard]] Result<void> bed_cleared() {
        return ledger_.commit(Commit{.gate = QueueGate{gate().hold_reason, false}});
    }

    // ---- the machine ----------------------------------------------------------------------------
    // Errors: unavailable (not connected, or its ring is full), not_permitted (does not apply now).
    /// May be called right after a job was begun, too: it pauses as soon as the machine prints.
    [[nodiscard]] Result<void> pause() { return runs_.pause(); }
    [[nodiscard]] Result<void> resume() { return runs_.resume(); }
    /// Durable: repeated until the machine has obeyed, also by a service that starts anew.
    [[nodiscard]] Result<void> cancel() { return runs_.cancel(); }
    [[nodiscard]] Result<void> clear_fault() { return machine_.clear_fault(); }
    /// All lines or none, in order. Errors: also invalid_argument (too long, or no single line).
    [[nodiscard]] Result<void> gcode(std::span<const std::string> lines);
    /// One line of a serial host (host_keeper.h). Errors: not_permitted, and as gcode().
    [[nodiscard]] Result<void> host_line(std::string_view line, HostClaim claim) {
        return host_.line(line, claim);
    }
    /// The host has gone. What it printed may still be on the bed.
    void host_leaves() { host_.leaves(); }
    /// The machine's answers to the host since the last call, oldest first; at most
    /// MachineLink::kRepliesHeld.
    [[nodiscard]] std::vector<Reply> take_host_replies() { return machine_.take_host_replies(); }
    [[nodiscard]] EmergencyLine& emergency() { return machine_.emergency(); }
    /// The machine at the last tick.
    [[nodiscard]] const MachineView& machine() const { return machine_.view(); }
    [[nodiscard]] const std::optional<Run>& active_run() const { return runs_.active(); }
    /// The guarantee report that the sketch published last, JSON, as the sketch wrote it; empty
    /// when not connected.
    [[nodiscard]] std::string guarantee() { return machine_.guarantee(); }

    /// Does everything that time brings. `now` is monotonic, `now_s` the calendar's.
    void tick(Instant now, UnixSeconds now_s);
    /// The replies since the last call, oldest first; at most MachineLink::kRepliesHeld.
    [[nodiscard]] std::vector<Reply> take_replies() { return machine_.take_replies(); }
    /// Lines for the log since the last call.
    [[nodiscard]] std::vector<std::string> take_log() { return ledger_.log().take(); }

  private:
    Spool(SpoolOptions options, std::unique_ptr<Storage> storage, LinkSource& link, Inspector* inspector)
        : options_(std::move(options)),
          storage_(std::move(storage)),
          ledger_(*storage_),
          house_(options_, ledger_),
          machine_(link, ledger_.log()),
          runs_(options_, ledger_, machine_, inspector),
          host_(options_, ledger_, machine_, runs_) {}
    [[nodiscard]] Result<void> load();

    SpoolOptions options_;
    std::unique_ptr<Storage> storage_;
    Ledger ledger_;
    Housekeeping house_;
    MachineLink machine_;
    RunKeeper runs_;
    HostKeeper host_;
};

}  // namespace qduino::spool
