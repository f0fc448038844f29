// The spool's start, and its work beside printing: it opens the journal, sweeps blobs, deletes jobs
// that have ended, and has the journal copied.
//
// An empty or older journal must not delete a person's files. So a file without a job's row is
// removed only when the journal can vouch for that. It must be the journal that these blobs belong
// to (blobs-journal-id), and no upload of the file may have been confirmed under a number that this
// journal never gave out. Everything else is set aside, with a line in the log, and waits for
// `printd --recover`.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "spool/ballast.h"
#include "spool/blob_store.h"
#include "spool/clock_watch.h"
#include "spool/journal.h"
#include "spool/ledger.h"
#include "spool/spool_options.h"

namespace qduino::spool {

class Housekeeping {
  public:
    /// Both outlive this.
    Housekeeping(const SpoolOptions& options, Ledger& ledger) : options_(options), ledger_(ledger) {}
    ~Housekeeping();
    Housekeeping(const Housekeeping&) = delete;
    Housekeeping& operator=(const Housekeeping&) = delete;

    /// Opens the blobs, and the journal for the ledger. Returns what the journal knows. Errors: as
    /// Store::open and BlobStore::open.
    [[nodiscard]] Result<StoredState> open();
    /// Everything is loaded: a journal that has no copy gets one.
    void begin() {
        if (copier_) copier_->begin_if_missing();
    }
    /// Once each tick.
    void keep(Instant now, UnixSeconds now_s);

    [[nodiscard]] const BlobStore& blobs() const { return *blobs_; }
    /// Spool::trouble. Any thread.
    [[nodiscard]] std::string trouble() const;
    /// Spool::check_room. Any thread.
    [[nodiscard]] Result<void> check_room() const;
    [[nodiscard]] Result<void> make_room(const std::string& sha256, std::uint64_t bytes);
    void drop_files(const Job& job);

  private:
    [[nodiscard]] Result<StoredState> load_journal();
    [[nodiscard]] Result<void> rebuild();
    [[nodiscard]] Result<void> set_strangers_aside();
    [[nodiscard]] Result<void> erase_ended(const std::vector<Job>& jobs);
    void sweep();
    void sweep_blob(const std::string& name);
    void retain(UnixSeconds now_s);

    const SpoolOptions& options_;
    Ledger& ledger_;
    std::unique_ptr<BlobStore> blobs_;
    std::unique_ptr<Ballast> ballast_;  // null: the journal is in memory
    ClockWatch clock_;
    std::unique_ptr<JournalCopier> copier_;      // null: nothing to copy
    std::filesystem::directory_iterator sweep_;  // through blobs/, a few entries each tick
    // Numbers from here on were not given out before this start.
    JobId first_new_id_ = 1;
    UnixSeconds retained_s_ = 0;  // when ages were last looked at
};

}  // namespace qduino::spool
