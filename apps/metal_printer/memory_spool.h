// The spool of a printer without a disk: one job prints, one waits, the last that ended is
// remembered.
//
//   upload ─► preflight ─► the one place that waits ─► link ─► sketch
//                                  ▲ start                 │ outcome
//                                  └────── the last one ◄──┘
//
// The rules of the queue are spool/queue.h's, and what becomes of a run is spool/run.h's. Nothing
// is durable: what was in memory is gone with the power, and as nobody then knows whether the bed
// is clear, the first job waits for a person to say so, as each one after a copy does.
//
// One thread.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "apps/metal_printer/file_places.h"
#include "base/result.h"
#include "base/time.h"
#include "printer/link/layout.h"
#include "printer/machine_config.h"
#include "spool/link_feed.h"
#include "spool/machine_view.h"
#include "spool/queue.h"
#include "spool/run.h"

namespace qduino::apps::metal {

/// An upload that is whole.
struct Uploaded {
    std::string name;
    FileBytes bytes;
    std::string sha256;
    bool print = false;  ///< the queue may begin it
};

class MemorySpool {
  public:
    MemorySpool(printer::link::LinkLayout& link, const printer::MachineConfig& machine)
        : link_(link), machine_config_(machine) {}

    /// Memory for a file that begins to come in; what the last job left gives way to it. Null: all
    /// is in use.
    [[nodiscard]] FileBytes take_place();
    /// Checks the file, and takes it as the job that waits. Errors: already_exists (one waits
    /// already); unsupported (no G-code); out_of_range (it breaks a rule, with its line).
    [[nodiscard]] Result<spool::JobId> add(Uploaded upload);
    /// Error: as Queue's plans; already_exists when another one waits.
    [[nodiscard]] Result<void> start(spool::JobId id);
    [[nodiscard]] Result<void> remove(spool::JobId id);
    /// Cancels the job that prints. Error: not_permitted.
    [[nodiscard]] Result<void> cancel();
    [[nodiscard]] Result<void> send(printer::link::Command command);
    void emergency_stop() { link_.emergency.fetch_add(1); }
    void bed_cleared() { bed_occupied_ = false; }

    /// Reads the machine's status, feeds it, begins what waits, and takes up what ended.
    void tick(Instant now);

    [[nodiscard]] const spool::MachineView& machine() const { return machine_; }
    /// The job that prints, that waits, and that ended last, as far as there are such.
    [[nodiscard]] std::vector<const spool::Job*> jobs() const;
    [[nodiscard]] const spool::Job* find(spool::JobId id) const;
    [[nodiscard]] const FileBytes& bytes_of(spool::JobId id) const { return bytes_.at(id); }
    [[nodiscard]] const std::optional<spool::Run>& run() const { return run_; }
    [[nodiscard]] bool bed_occupied() const { return bed_occupied_; }

  private:
    /// A run's bytes are in memory.
    class Feed final : public spool::LinkFeed {
      public:
        Feed(FileBytes bytes, std::uint64_t run_id)
            : LinkFeed(run_id, bytes->size()), bytes_(std::move(bytes)) {}

      private:
        [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset,
                                                  std::span<std::uint8_t> bytes) override;
        FileBytes bytes_;
    };

    [[nodiscard]] bool is_waiting() const { return !queue_.queued().empty(); }
    void apply(const spool::Change& change);
    void begin_next();
    void go_on(Instant now);
    void end_run(spool::CopyOutcome outcome, const std::string& reason);
    void forget_ended();

    printer::link::LinkLayout& link_;
    printer::MachineConfig machine_config_;
    spool::MachineView machine_;
    spool::Queue queue_;
    FilePlaces places_;
    std::map<spool::JobId, FileBytes> bytes_;
    std::optional<spool::Job> ended_;
    std::optional<spool::Run> run_;
    std::optional<Feed> feed_;
    std::uint64_t last_run_ = 0;
    std::optional<Instant> cancel_sent_;
    bool bed_occupied_ = true;
};

}  // namespace qduino::apps::metal
