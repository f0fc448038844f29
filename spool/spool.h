// The spool: jobs in, copies out. Ties the pure parts (queue, run) to the journal, the files and
// the link.
//
//          add, patch, start …            tick, 50 times a second
//                │                              │
//                ▼                              ▼
//   Queue ── plan ──► Store.commit      read the machine → decide(run)
//                         └─► apply          → feed | record the outcome | begin
//
// It all runs on one thread, "the spool's thread", which may block on the disk. A caller that must
// not wait (the web's I/O thread, an emergency stop) does not call it directly. EmergencyLine is
// the one exception, and thread-safe.
//
// Invariants: what a call reported as done is durable. At most one run is active. A run is durable
// before its first byte crosses the link. The next run begins only after the outcome of the last
// one is durable and its inspection is over.
//
// It has more functions and members than other classes. A third of the functions are the service's
// calls, and all the others change what a commit must find whole: queue, gate and run. Files part
// it by subject: the calls and the run (spool.cpp), the start (recovery.cpp), old files and old
// jobs (housekeeping.cpp).
#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "printer/link/frame.h"
#include "spool/analyzer.h"
#include "spool/ballast.h"
#include "spool/blob_store.h"
#include "spool/clock_watch.h"
#include "spool/feeder.h"
#include "spool/inspector.h"
#include "spool/journal.h"
#include "spool/link_source.h"
#include "spool/machine_view.h"
#include "spool/queue.h"
#include "spool/run.h"
#include "spool/store.h"

namespace qduino::spool {

/// How long ended jobs are kept; 0: no limit of this kind. The job that ended first goes first,
/// with its files. Jobs that wait or print are never deleted.
struct Retention {
    std::int64_t jobs_max = 100'000;
    std::int64_t days_max = 0;
    std::uint64_t bytes_max = 0;  ///< of all stored files
};

/// The jobs that a person wants to see, in the order of the list: printing, waiting in the queue's
/// order, ended with the newest first.
struct JobQuery {
    static constexpr std::size_t kLimitMax = 1000;

    std::size_t limit = 50;
    std::optional<JobId> before;  ///< what stands behind this one; an unknown one: from the start
    /// The states wanted.
    bool waiting = true, held = true, printing = true, done = true, cancelled = true, failed = true;
    std::string text;  ///< a part of the name, in any case
    /// The first page has every printing job, the first kFirstWaiting that wait, and `limit` of the
    /// ended.
    static constexpr std::size_t kFirstWaiting = 100;
    [[nodiscard]] bool is_first_page() const {
        return !before && text.empty() && waiting && held && printing && done && cancelled && failed;
    }
};

struct JobPage {
    std::vector<Job> jobs;
    std::optional<JobId> next_before;  ///< the next page stands behind it; empty: there is none
};

struct SpoolOptions {
    std::filesystem::path folder;
    BlobLimits limits;
    bool journal_in_memory = false;  ///< for fuzzing: nothing survives
    bool hold_after_failure = true;  ///< a failed job holds the queue until a person releases it
    /// After a copy that moved, wait for a person to clear the bed.
    bool confirm_bed = true;
    Retention retention;
    /// Reads the facts of jobs that a damaged journal has lost; null: those get none.
    Analyzer* analyzer = nullptr;
    UnixSeconds opened_s = 0;  ///< now; names what has to be set aside
    /// Nothing is deleted by its age while the calendar is before this.
    UnixSeconds calendar_from_s = ClockWatch::kFirst_s;
};

/// Text from the machine.
struct Reply {
    printer::link::ReplyKind kind = printer::link::ReplyKind::text;
    std::string text;
};

/// How a serial host's lines cross the link.
enum class HostClaim : std::uint8_t {
    none,     ///< a question, or what may be done beside a job
    printer,  ///< the line moves or waits: the host has the printer from here on
};

/// Takes an emergency stop to the machine: one atomic, never behind a disk. Any thread.
class EmergencyLine {
  public:
    /// Error: unavailable, when no machine is connected.
    [[nodiscard]] Result<void> stop();

  private:
    friend class Spool;
    void attach(printer::link::LinkLayout* link);
    std::mutex mutex_;  // held for one store, or for one pointer swap
    printer::link::LinkLayout* link_ = nullptr;
};

/// An uploader's wishes.
struct NewJob {
    std::string name;
    int copies = 1;
    int priority = 0;
    bool hold = false;
};

class Spool {
  public:
    /// `link` and `inspector` (may be null) outlive the spool. Errors: as Store::open and
    /// BlobStore::open.
    [[nodiscard]] static Result<std::unique_ptr<Spool>> open(SpoolOptions options, LinkSource& link,
                                                             Inspector* inspector);
    ~Spool();

    // ---- jobs -----------------------------------------------------------------------------------
    /// Makes a job of a sealed and analyzed file: durable when this returns. Errors:
    /// invalid_argument, unavailable (disk or store full).
    [[nodiscard]] Result<JobId> add(StagedFile& file, const Analysis& analysis, const NewJob& wanted,
                                    UnixSeconds now_s);
    [[nodiscard]] Result<void> patch(JobId id, const JobPatch& patch);
    [[nodiscard]] Result<void> remove(JobId id);
    [[nodiscard]] Result<void> start(JobId id);
    /// The jobs that wait or print.
    [[nodiscard]] const Queue& queue() const { return queue_; }
    /// Any job; nothing when no job has this number.
    [[nodiscard]] std::optional<Job> find(JobId id) const;
    /// Reads no more rows than it returns, except for a search. Error: as Store::ended.
    [[nodiscard]] Result<JobPage> page(const JobQuery& query) const;
    [[nodiscard]] const JobCounts& counts() const { return store_->counts(); }
    [[nodiscard]] bool confirms_bed() const { return options_.confirm_bed; }
    [[nodiscard]] const BlobStore& blobs() const { return *blobs_; }
    [[nodiscard]] Store& store() { return *store_; }
    /// Why nothing that is taken now would be kept; empty: all is well. Any thread.
    [[nodiscard]] std::string trouble() const;
    /// Room for an upload. Errors: unavailable (the disk is full), internal. Any thread.
    [[nodiscard]] Result<void> check_room() const;
    /// Grows whenever the jobs or the gate change.
    [[nodiscard]] std::uint64_t revision() const { return revision_; }

    // ---- what printing waits for ----------------------------------------------------------------
    [[nodiscard]] const QueueGate& gate() const { return gate_; }
    [[nodiscard]] Result<void> hold_queue(std::string reason);
    /// Error: not_permitted, while a serial host has the printer.
    [[nodiscard]] Result<void> release_queue();
    [[nodiscard]] Result<void> bed_cleared() { return commit({.gate = QueueGate{gate_.hold_reason, false}}); }

    // ---- the machine ----------------------------------------------------------------------------
    // Errors: unavailable (not connected, or its ring is full), not_permitted (does not apply now).
    /// May be called right after a job was begun, too: it pauses as soon as the machine prints.
    [[nodiscard]] Result<void> pause();
    [[nodiscard]] Result<void> resume();
    /// Durable: repeated until the machine has obeyed, also by a service that starts anew.
    [[nodiscard]] Result<void> cancel();
    [[nodiscard]] Result<void> clear_fault();
    /// All lines or none, in order. Errors: also invalid_argument (too long, or no single line).
    [[nodiscard]] Result<void> gcode(std::span<const std::string> lines);
    /// One line of a serial host. Jobs and a host exclude each other: a line that claims the
    /// printer is refused while a job is printed, and no job begins until host_leaves(). Errors:
    /// not_permitted, and as gcode().
    [[nodiscard]] Result<void> host_line(std::string_view line, HostClaim claim);
    /// The host has gone. What it printed may still be on the bed.
    void host_leaves();
    /// The machine's answers to the host since the last call, oldest first; at most kRepliesHeld.
    [[nodiscard]] std::vector<Reply> take_host_replies() { return std::exchange(host_replies_, {}); }
    [[nodiscard]] EmergencyLine& emergency() { return emergency_; }
    /// The machine at the last tick.
    [[nodiscard]] const MachineView& machine() const { return machine_; }
    [[nodiscard]] const std::optional<Run>& active_run() const { return run_; }
    /// The guarantee report that the sketch published last, JSON, as the sketch wrote it; empty
    /// when not connected.
    [[nodiscard]] std::string guarantee();

    /// Does everything that time brings. `now` is monotonic, `now_s` the calendar's.
    void tick(Instant now, UnixSeconds now_s);
    /// The replies since the last call, oldest first; at most kRepliesHeld.
    [[nodiscard]] std::vector<Reply> take_replies() { return std::exchange(replies_, {}); }
    /// Lines for the log since the last call.
    [[nodiscard]] std::vector<std::string> take_log() { return std::exchange(log_, {}); }

    static constexpr std::size_t kRepliesHeld = 1000;
    /// A sketch whose heartbeat stands still for this long is given nothing. Only its supervisor
    /// may call it dead.
    static constexpr Nanoseconds kSilentAfter = std::chrono::seconds{3};
    /// The job of a dead sketch fails without its supervisor's reason when that has not come after
    /// this long.
    static constexpr Nanoseconds kExplainedWithin = std::chrono::seconds{1};

  private:
    Spool(SpoolOptions options, LinkSource& link, Inspector* inspector);
    [[nodiscard]] Result<void> load();
    [[nodiscard]] Result<void> commit_jobs(Result<Change> change);
    [[nodiscard]] Result<void> commit(const Commit& commit);
    void attach_link();
    void read_replies();
    void advance_run(Instant now, UnixSeconds now_s);
    void feed_run(const RunAction& action, Instant now, UnixSeconds now_s);
    void repeat_cancel(Instant now);
    void finish_run(CopyOutcome outcome, const std::string& reason, UnixSeconds now_s);
    [[nodiscard]] Result<StoredState> load_journal();
    [[nodiscard]] Result<void> rebuild();
    [[nodiscard]] Result<void> set_strangers_aside();
    [[nodiscard]] Result<Job> find_job(JobId id) const;
    [[nodiscard]] Result<void> make_room(const std::string& sha256, std::uint64_t bytes);
    [[nodiscard]] Result<void> erase_ended(const std::vector<Job>& jobs);
    void drop_files(const Job& job);
    void keep_house(Instant now, UnixSeconds now_s);
    void sweep();
    void sweep_blob(const std::string& name);
    void retain(UnixSeconds now_s);
    void note_place();
    void tell_typed_objects();
    void await_report();
    [[nodiscard]] bool may_begin();
    void begin_next(UnixSeconds now_s);
    [[nodiscard]] Result<void> claim_for_host();
    [[nodiscard]] Result<void> check_connected() const;
    [[nodiscard]] Result<void> push_command(printer::link::Command command, std::string_view text);
    void log_line(std::string line);
    template <typename... Pieces>
    void log(const Pieces&... pieces) {
        log_line(text<std::string>(pieces...));
    }
    void watch_heartbeat(Instant now);
    void watch_death(Instant now, bool replaced);

    SpoolOptions options_;
    LinkSource& link_;
    Inspector* inspector_;
    std::unique_ptr<BlobStore> blobs_;
    std::unique_ptr<Store> store_;
    std::unique_ptr<Ballast> ballast_;  // null: the journal is in memory
    ClockWatch clock_;
    std::unique_ptr<JournalCopier> copier_;      // null: nothing to copy
    std::filesystem::directory_iterator sweep_;  // through blobs/, a few entries each tick
    // Numbers from here on were not given out before this start.
    JobId first_new_id_ = 1;
    UnixSeconds retained_s_ = 0;  // when ages were last looked at
    CopyEnd place_;               // how far the active run is, as the machine last said
    Queue queue_;
    QueueGate gate_;
    std::optional<Run> run_;
    std::optional<Run> awaited_report_;
    std::uint32_t typed_told_ = 0;  // lines of the run that the inspector knows
    std::optional<Feeder> feeder_;
    std::uint64_t last_run_id_ = 0;
    std::uint64_t revision_ = 1;
    MachineView machine_;
    EmergencyLine emergency_;
    printer::link::FrameReader reply_reader_;
    std::optional<Instant> cancel_sent_at_;
    bool pause_wanted_ = false;  // asked for before the machine had begun the job
    std::vector<Reply> replies_;
    std::vector<Reply> host_replies_;
    bool host_has_printer_ = false;
    std::uint64_t heartbeat_ = 0;
    Instant heartbeat_at_{};             // when it last changed
    std::optional<Instant> dead_since_;  // as this service saw it
    std::vector<std::string> log_;
    std::string last_log_;
};

}  // namespace qduino::spool
