// The bytes of jobs on a disk, as files that the server names.
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
//   seal    fdatasync, SHA-256
//   adopt   rename into blobs/, fsync the folder: before the row of the job commits
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
#include "posix/file_bytes.h"
#include "posix/unique_fd.h"
#include "spool/disk/sha256.h"
#include "spool/files.h"

namespace qduino::spool {

struct BlobLimits {
    std::uint64_t size_max_bytes = std::uint64_t{2} << 30;
    /// Left free for the journal and for others.
    std::uint64_t free_space_min_bytes = std::uint64_t{64} << 20;
};

/// An upload in incoming/.
class IncomingFile final : public StagedFile {
  public:
    ~IncomingFile() override;
    IncomingFile(const IncomingFile&) = delete;
    IncomingFile& operator=(const IncomingFile&) = delete;

    [[nodiscard]] Result<void> write(std::span<const char> bytes) override;
    [[nodiscard]] Result<void> seal() override;
    [[nodiscard]] ByteSink& layers() override { return layers_; }
    [[nodiscard]] std::shared_ptr<const ByteSource> content() const override;
    [[nodiscard]] std::uint64_t layers_bytes() const override;

    [[nodiscard]] const std::filesystem::path& path() const { return path_; }
    /// The file into which its layers are packed.
    [[nodiscard]] std::filesystem::path layers_path() const { return path_.string() + ".layers"; }

  private:
    friend class BlobStore;
    class Layers final : public ByteSink {
      public:
        explicit Layers(std::filesystem::path path) : file_(std::move(path)) {}
        [[nodiscard]] Result<void> write(std::span<const char> bytes) override;

      private:
        posix::FileSink file_;
    };
    IncomingFile(std::filesystem::path path, posix::UniqueFd file, BlobLimits limits);

    std::filesystem::path path_;
    posix::UniqueFd file_;
    Layers layers_{layers_path()};
    BlobLimits limits_;
    Sha256 hash_;
    std::uint64_t space_checked_at_ = 0;
};

/// Kinds of files that belong to one blob: those of FilePart, and the uploads, from which a lost
/// journal is rebuilt.
enum class BlobPart : std::uint8_t { gcode, layers, layers_index, thumbnail, record, new_record };

class BlobStore final : public Files {
  public:
    /// How many uploads of the same bytes are remembered: the newest.
    static constexpr std::size_t kRecordsMax = 256;

    /// Makes the folders (mode 0700) and sweeps incoming/. Errors: not_permitted, unavailable,
    /// internal.
    [[nodiscard]] static Result<std::unique_ptr<BlobStore>> open(const std::filesystem::path& folder,
                                                                 BlobLimits limits);

    /// A new file in incoming/.
    [[nodiscard]] Result<std::unique_ptr<StagedFile>> stage() override;
    /// Moves a file of this store and its packed layers into blobs/, writes its small companions,
    /// and makes that durable.
    [[nodiscard]] Result<void> adopt(StagedFile& file, const FileCompanions& companions,
                                     const UploadRecord& record) override;
    /// The same for a blob that lies in set-aside/ or in blobs/ already; its packed layers are at
    /// `layers`.
    [[nodiscard]] Result<void> adopt_again(const std::string& sha256, const std::filesystem::path& layers,
                                           const FileCompanions& companions,
                                           std::span<const UploadRecord> records);
    void confirm(const std::string& sha256) override;
    void forget(const std::string& sha256, JobId id) override;
    /// The uploads that were confirmed, oldest first. Empty when none was, or when an older program
    /// stored the blob.
    [[nodiscard]] std::vector<UploadRecord> records(const std::string& sha256) const;

    void remove(const std::string& sha256) override;
    [[nodiscard]] std::shared_ptr<const ByteSource> content(const std::string& sha256,
                                                            FilePart part) const override;
    [[nodiscard]] std::string place_of(const std::string& sha256) const override {
        return path(sha256, BlobPart::gcode);
    }
    [[nodiscard]] std::uint64_t size_max_bytes() const override { return limits_.size_max_bytes; }

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

  private:
    BlobStore(std::filesystem::path folder, BlobLimits limits);
    [[nodiscard]] static std::filesystem::path part_of(const std::filesystem::path& folder,
                                                       const std::string& sha256, BlobPart part);
    [[nodiscard]] static std::vector<std::string> blobs_in(const std::filesystem::path& folder);
    [[nodiscard]] Result<void> take_in(const std::string& sha256, const std::filesystem::path& gcode,
                                       const std::filesystem::path& layers, const FileCompanions& companions,
                                       std::span<const UploadRecord> records) const;
    std::filesystem::path folder_;
    std::filesystem::path incoming_;
    std::filesystem::path blobs_;
    std::filesystem::path set_aside_;
    BlobLimits limits_;
};

}  // namespace qduino::spool
