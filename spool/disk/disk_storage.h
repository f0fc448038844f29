// What a spool keeps its jobs in where there is a disk: the journal, the blobs, the journal's copy,
// and room for what must work when the disk is full.
//
// An empty or older journal must not delete a person's files. So a file without a job's row is
// removed only when the journal can vouch for that. It must be the journal that these blobs belong
// to (blobs-journal-id), and no upload of the file may have been confirmed under a number that this
// journal never gave out. Everything else is set aside, with a line in the log, and waits for
// `printd --recover`.
#pragma once

#include <filesystem>
#include <memory>

#include "spool/analyzer.h"
#include "spool/disk/ballast.h"
#include "spool/disk/blob_store.h"
#include "spool/disk/journal.h"
#include "spool/storage.h"

namespace qduino::spool {

struct DiskOptions {
    std::filesystem::path folder;
    BlobLimits limits{};
    /// Reads the facts of jobs that a damaged journal has lost; null: those get none.
    Analyzer* analyzer = nullptr;
    UnixSeconds opened_s = 0;  ///< now; names what has to be set aside
};

class DiskStorage final : public Storage {
  public:
    /// Errors: as BlobStore::open and open_journal.
    [[nodiscard]] static Result<std::unique_ptr<DiskStorage>> open(DiskOptions options);
    /// Copies the journal once more. If that fails, the copy is an older one.
    ~DiskStorage() override;

    [[nodiscard]] SqliteStore& store() override { return *store_; }
    [[nodiscard]] BlobStore& files() override { return *blobs_; }
    [[nodiscard]] Result<StoredState> load() override;
    void keep(Instant now) override;
    [[nodiscard]] News take_news() override { return std::exchange(news_, {}); }
    [[nodiscard]] bool is_durable() const override { return true; }
    [[nodiscard]] std::string trouble() const override;
    [[nodiscard]] Result<void> check_room() const override;

  private:
    explicit DiskStorage(DiskOptions options)
        : options_(std::move(options)), ballast_(options_.folder), copier_(options_.folder) {}
    [[nodiscard]] Result<void> rebuild();
    [[nodiscard]] Result<void> set_strangers_aside(QueueGate& gate);
    void sweep();
    void sweep_blob(const std::string& name);
    template <typename... Pieces>
    void log(const Pieces&... pieces) {
        news_.log.push_back(text<std::string>(pieces...));
    }

    DiskOptions options_;
    std::unique_ptr<BlobStore> blobs_;
    std::unique_ptr<SqliteStore> store_;
    Ballast ballast_;
    JournalCopier copier_;
    std::filesystem::directory_iterator sweep_;  // through blobs/, a few entries each tick
    // Numbers from here on were not given out before this start.
    JobId first_new_id_ = 1;
    News news_;
};

}  // namespace qduino::spool
