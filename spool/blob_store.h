// The bytes of jobs, as files that the server names.
//
//   DIR/incoming/RANDOM            an upload on its way; swept away at the next start
//   DIR/blobs/SHA256.gcode         whole, durable, never changed; what printing reads
//   DIR/blobs/SHA256.layers        its packed layers;  .layers.json their index;  .png its thumbnail
//
//   StagedFile: write … write → seal (fdatasync, SHA-256)        on a worker thread
//   BlobStore:  adopt: rename into blobs/, fsync the folder       on the spool's thread, before the job's row commits
//
// Invariant: a file in blobs/ is whole. One without a job's row (killed between rename and commit) is swept at start.
// No name that a client sent ever becomes part of a path.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "base/result.h"
#include "spool/sha256.h"

namespace qduino::spool {

struct BlobLimits {
    std::uint64_t size_max_bytes = std::uint64_t{2} << 30;
    std::uint64_t free_space_min_bytes = std::uint64_t{64} << 20;  ///< left for the journal and everyone else
};

/// A file on its way in. Any one thread at a time. Removed with its companions when destroyed, unless adopted.
class StagedFile {
  public:
    ~StagedFile();
    StagedFile(const StagedFile&) = delete;
    StagedFile& operator=(const StagedFile&) = delete;

    /// Appends. Errors: out_of_range (longer than the limit), unavailable (disk full), internal (I/O).
    [[nodiscard]] Result<void> write(std::span<const char> bytes);
    /// On the disk, and hashed. Once; no write after it. Errors as write().
    [[nodiscard]] Result<void> seal();

    [[nodiscard]] std::uint64_t size() const { return size_; }
    /// After seal().
    [[nodiscard]] const std::string& sha256() const { return sha256_; }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// Where the analyzer packs this file's layers.
    [[nodiscard]] std::filesystem::path layers_path() const { return path_.string() + ".layers"; }

  private:
    friend class BlobStore;
    StagedFile(std::filesystem::path path, int descriptor, BlobLimits limits);

    std::filesystem::path path_;
    int descriptor_;
    BlobLimits limits_;
    Sha256 hash_;
    std::uint64_t size_ = 0;
    std::uint64_t space_checked_at_ = 0;
    std::string sha256_;
};

/// Kinds of files that belong to one blob.
enum class BlobPart : std::uint8_t { gcode, layers, layers_index, thumbnail };

class BlobStore {
  public:
    /// Makes the folders (mode 0700) and sweeps incoming/. Errors: not_permitted, unavailable, internal.
    [[nodiscard]] static Result<std::unique_ptr<BlobStore>> open(const std::filesystem::path& folder,
                                                                 BlobLimits limits);

    /// A new file in incoming/. Any thread. Errors: unavailable (disk full), internal.
    [[nodiscard]] Result<std::unique_ptr<StagedFile>> stage() const;
    /// Moves a sealed file and its packed layers into blobs/, writes its small companions, and makes that durable.
    /// The same bytes may be there already: then nothing is moved. Errors: unavailable, internal.
    [[nodiscard]] Result<void> adopt(StagedFile& file, std::string_view layers_index,
                                     std::string_view thumbnail) const;
    /// Removes all parts of a blob. A part that is not there is not missed.
    void remove(const std::string& sha256) const;
    /// Removes every blob whose SHA-256 is not in `wanted`.
    void sweep(const std::set<std::string>& wanted) const;

    [[nodiscard]] std::filesystem::path path(const std::string& sha256, BlobPart part) const;
    [[nodiscard]] const BlobLimits& limits() const { return limits_; }

  private:
    BlobStore(std::filesystem::path folder, BlobLimits limits);
    std::filesystem::path incoming_;
    std::filesystem::path blobs_;
    BlobLimits limits_;
};

}  // namespace qduino::spool
