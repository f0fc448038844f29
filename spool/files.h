// THE SEAM: the bytes of jobs, by their SHA-256. On a disk (disk/blob_store.h), or in memory
// (memory_storage.h). tests/unit/spool/storage_contract_test.cpp holds both.
//
//   StagedFile: write … write → seal           on worker threads, one at a time
//   Files:      adopt, and then the row of the job commits, and then confirm     the spool's thread
//
// Invariants: what content() gives is whole, and never changes. No name that a client sent ever
// becomes part of a place.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>

#include "base/bytes.h"
#include "base/result.h"
#include "spool/job.h"

namespace qduino::spool {

/// An upload on its way in. One thread at a time. Unless adopted, it is gone with its companions
/// when it is destroyed.
class StagedFile {
  public:
    virtual ~StagedFile() = default;

    /// Appends. Errors: out_of_range (longer than the limit), unavailable (no room), internal
    /// (I/O).
    [[nodiscard]] virtual Result<void> write(std::span<const char> bytes) = 0;
    /// It is whole: brings it to where it is safe, and hashes it. Once; no write after it. Errors
    /// as write().
    [[nodiscard]] virtual Result<void> seal() = 0;
    /// Into this the analyzer packs its layers. Lives as long as the file.
    [[nodiscard]] virtual ByteSink& layers() = 0;
    /// What was written. After seal(); not beyond the life of this.
    [[nodiscard]] virtual std::shared_ptr<const ByteSource> content() const = 0;
    /// How much has been packed.
    [[nodiscard]] virtual std::uint64_t layers_bytes() const = 0;

    [[nodiscard]] std::uint64_t size() const { return size_; }
    /// Known after seal().
    [[nodiscard]] const std::string& sha256() const { return sha256_; }

  protected:
    std::uint64_t size_ = 0;
    std::string sha256_;
};

/// What is kept of one file.
enum class FilePart : std::uint8_t { gcode, layers, layers_index, thumbnail };

/// One upload of a file's bytes.
struct UploadRecord {
    JobId id = 0;
    UnixSeconds uploaded_s = 0;
    std::string name;
};

/// The small files beside the bytes.
struct FileCompanions {
    std::string_view layers_index;
    std::string_view thumbnail;
};

class Files {
  public:
    virtual ~Files() = default;

    /// A new file on its way. Any thread. Errors: unavailable (no room), internal.
    [[nodiscard]] virtual Result<std::unique_ptr<StagedFile>> stage() = 0;
    /// Keeps a sealed file, its packed layers and its small companions. The same bytes may be there
    /// already: then those stay. Errors: unavailable, internal.
    [[nodiscard]] virtual Result<void> adopt(StagedFile& file, const FileCompanions& companions,
                                             const UploadRecord& record) = 0;
    /// The rows of all uploads of these bytes are in the store.
    virtual void confirm(const std::string&) {}
    /// One upload is deleted whose bytes other jobs still need.
    virtual void forget(const std::string&, JobId) {}
    /// Removes the file with all its parts. One that is missing is no error.
    virtual void remove(const std::string& sha256) = 0;

    /// Null: there is no such part. Any thread.
    [[nodiscard]] virtual std::shared_ptr<const ByteSource> content(const std::string& sha256,
                                                                    FilePart part) const = 0;
    /// Where another process finds the G-code; empty: no other can read it.
    [[nodiscard]] virtual std::string place_of(const std::string&) const { return {}; }
    /// The longest file that is taken.
    [[nodiscard]] virtual std::uint64_t size_max_bytes() const = 0;
};

/// The bytes that adopt() will keep.
[[nodiscard]] inline std::uint64_t stored_bytes_of(const StagedFile& file, const FileCompanions& companions) {
    return file.size() + file.layers_bytes() + companions.layers_index.size() + companions.thumbnail.size();
}

}  // namespace qduino::spool
