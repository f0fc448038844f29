// The bytes of jobs, as files that the server names.
//
//   DIR/incoming/RANDOM         an upload on its way; swept away at the next start
//   DIR/blobs/SHA256.gcode      whole, durable, never changed; printing reads it
//   DIR/blobs/SHA256.layers     its packed layers;  .layers.json their index;  .png its thumbnail
//   DIR/blobs/SHA256.job        the uploads that brought these bytes (UploadRecord);
//                               .job.new until the journal has their rows
//   DIR/set-aside/SHA256.*      blobs without a journal that vouches for them;
//                               `printd --recover` makes jobs of them again
//   DIR/blobs-journal-id        the journal that these blobs belong to
//
//   StagedFile: write … write → seal (fdatasync, SHA-256)     on a worker thread
//   BlobStore:  adopt: rename into blobs/, fsync the folder   on the spool's thread, before the row
//                                                             of the job commits
//
// Invariants: a file in blobs/ is whole. A file without a job's row was left by a kill between
// rename and commit, or between the deletion of its row and its own. Only the journal that these
// blobs belong to can vouch for that, and only such files are ever removed. No name that a client
// sent ever becomes part of a path.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "posix/unique_fd.h"
#include "spool/job.h"
#include "spool/sha256.h"

namespace qduino::spool {

struct BlobLimits {
    std::uint64_t size_max_bytes = std::uint64_t{2} << 30;
    /// Left free for the journal and for others.
    std::uint64_t free_space_min_bytes = std::uint64_t{64} << 20;
};

/// An upload on its way in. One thread at a time. Unless adopted, it is removed with its companions
/// when it is destroyed.
class StagedFile {
  public:
    ~StagedFile();
    StagedFile(const StagedFile&) = delete;
    StagedFile& operator=(const StagedFile&) = delete;

    /// Appends. Errors: out_of_range (longer than the limit), unavailable (disk full), internal
    /// (I/O).
    [[nodiscard]] Result<void> write(std::span<const char> bytes);
    /// Brings it to the disk, and hashes it. Once; no write after it. Errors as write().
    [[nodiscard]] Result<void> seal();

    [[nodiscard]] std::uint64_t size() const { return size_; }
    /// Known after seal().
    [[nodiscard]] const std::string& sha256() const { return sha256_; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// The file into which the analyzer packs this file's layers.
    [[nodiscard]] std::filesystem::path layers_path() const { return path_.string() + ".layers"; }

  private:
    friend class BlobStore;
    StagedFile(std::filesystem::path path, posix::UniqueFd file, BlobLimits limits);

    std::filesystem::path path_;
    posix::UniqueFd file_;
    BlobLimits limits_;
    Sha256 hash_;
    std::uint64_t size_ = 0;
    std::uint64_t space_checked_at_ = 0;
    std::string sha256_;
};

/// Kinds of files that belong to one blob.
enum class BlobPart : std::uint8_t { gcode, layers, layers_index, thumbnail, record, new_record };

/// One upload of a blob's bytes, written beside them: from it a lost journal is rebuilt.
struct UploadRecord {
    JobId id = 0;
    UnixSeconds uploaded_s = 0;
    std::string name;
};

/// The small files beside the bytes.
struct BlobCompanions {
    std::string_view layers_index;
    std::string_view thumbnail;
};

class BlobStore {
  public:
    /// How many uploads of the same bytes are remembered: the newest.
    static constexpr std::size_t kRecordsMax = 256;

    /// Makes the folders (mode 0700) and sweeps incoming/. Errors: not_permitted, unavailable,
    /// internal.
    [[nodiscard]] static Result<std::unique_ptr<BlobStore>> open(const std::filesystem::path& folder,
                                                                 BlobLimits limits);

    /// A new file in incoming/. Any thread. Errors: unavailable (disk full), internal.
    [[nodiscard]] Result<std::unique_ptr<StagedFile>> stage() const;
    /// The bytes that adopt() will store. There may be no packed layers.
    [[nodiscard]] static std::uint64_t size_of(std::uint64_t gcode_bytes,
                                               const std::filesystem::path& packed_layers,
                                               const BlobCompanions& companions);
    /// Moves a sealed file and its packed layers into blobs/, writes its small companions, and
    /// makes that durable. The same bytes may be there already: then nothing is moved. Errors:
    /// unavailable, internal.
    [[nodiscard]] Result<void> adopt(StagedFile& file, const BlobCompanions& companions,
                                     const UploadRecord& record) const;
    /// The same for a blob that lies in set-aside/ or in blobs/ already; its packed layers are at
    /// `layers`.
    [[nodiscard]] Result<void> adopt_again(const std::string& sha256, const std::filesystem::path& layers,
                                           const BlobCompanions& companions,
                                           std::span<const UploadRecord> records) const;
    /// Call when the journal has the rows of all uploads of this blob.
    void confirm(const std::string& sha256) const;
    /// Call when one upload of a blob is deleted that other jobs still need.
    void forget(const std::string& sha256, JobId id) const;
    /// The uploads that were confirmed, oldest first. Empty when none was, or when an older program
    /// stored the blob.
    [[nodiscard]] std::vector<UploadRecord> records(const std::string& sha256) const;

    /// Removes all parts of a blob. A missing part is no error.
    void remove(const std::string& sha256) const;
    /// Removes a file of blobs/ whose writing was never finished.
    void remove_partial(const std::string& name) const;
    /// Moves all parts of a blob to set-aside/. Error: internal, when that folder cannot be
    /// written.
    [[nodiscard]] Result<void> set_aside(const std::string& sha256) const;
    /// SHA-256 of all blobs in set-aside/, or in blobs/. Reads the whole folder.
    [[nodiscard]] std::vector<std::string> all_set_aside() const { return blobs_in(set_aside_); }
    [[nodiscard]] std::vector<std::string> all() const { return blobs_in(blobs_); }
    [[nodiscard]] const std::filesystem::path& blobs_folder() const { return blobs_; }

    /// The journal that the blobs belong to; empty: not known.
    [[nodiscard]] std::string journal_id() const;
    [[nodiscard]] Result<void> set_journal_id(std::string_view id) const;

    [[nodiscard]] std::filesystem::path path(const std::string& sha256, BlobPart part) const {
        return part_of(blobs_, sha256, part);
    }
    /// Where the G-code lies, in blobs/ or in set-aside/.
    [[nodiscard]] std::filesystem::path find_gcode(const std::string& sha256) const;
    [[nodiscard]] const BlobLimits& limits() const { return limits_; }

  private:
    BlobStore(std::filesystem::path folder, BlobLimits limits);
    [[nodiscard]] static std::filesystem::path part_of(const std::filesystem::path& folder,
                                                       const std::string& sha256, BlobPart part);
    [[nodiscard]] static std::vector<std::string> blobs_in(const std::filesystem::path& folder);
    [[nodiscard]] Result<void> take_in(const std::string& sha256, const std::filesystem::path& gcode,
                                       const std::filesystem::path& layers, const BlobCompanions& companions,
                                       std::span<const UploadRecord> records) const;
    std::filesystem::path folder_;
    std::filesystem::path incoming_;
    std::filesystem::path blobs_;
    std::filesystem::path set_aside_;
    BlobLimits limits_;
};

}  // namespace qduino::spool
