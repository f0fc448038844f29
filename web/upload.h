// One upload: body bytes → a staged file and the fields that came with it. No sockets; runs on a
// worker thread.
//
//   raw (PUT):     body ───────────────────────────► StagedFile
//   multipart:     body ─► MultipartParser ─┬ file ─► StagedFile
//                                           └ other parts ─► fields (small, bounded)
//
// Nothing is queued from here. A file that was not sealed is removed when the upload is destroyed.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "spool/blob_store.h"
#include "web/http.h"
#include "web/multipart.h"

namespace qduino::web {

class Upload {
  public:
    virtual ~Upload() = default;

    /// Body bytes in order. Errors: invalid_argument, out_of_range (too long), unavailable (disk
    /// full), unsupported.
    [[nodiscard]] virtual Result<void> take(std::span<const char> bytes) = 0;
    /// The body has ended where its sender announced: seals the file. Errors: as take(), and
    /// corrupt (another SHA-256 than declared).
    [[nodiscard]] Result<void> finish();

    /// The file is from now on `lines` and what was received. After finish(). Errors: as take().
    [[nodiscard]] Result<void> put_before(const std::string& lines);
    /// Removes what was received. Call it before a refusal is answered: a client that reads the
    /// answer then finds nothing left behind.
    void discard() { file_.reset(); }

    /// After finish().
    [[nodiscard]] spool::StagedFile& file() { return *file_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    /// A field that came along; empty when absent.
    [[nodiscard]] std::string field(const std::string& name) const;
    [[nodiscard]] std::uint64_t received() const { return file_ ? file_->size() : 0; }

  protected:
    explicit Upload(const spool::BlobStore& blobs) : blobs_(blobs) {}
    [[nodiscard]] virtual Result<void> end() = 0;
    [[nodiscard]] Result<void> begin_file(std::string name);

    const spool::BlobStore& blobs_;
    std::unique_ptr<spool::StagedFile> file_;
    std::string name_;
    std::map<std::string, std::string> fields_;
};

/// POST with multipart/form-data, one part of which is `file`. Errors: as boundary_of().
[[nodiscard]] Result<std::unique_ptr<Upload>> open_multipart(const spool::BlobStore& blobs,
                                                             const RequestHead& head,
                                                             const std::vector<std::string>& arguments);

/// PUT whose body is the file; its name is the last of `arguments`. Errors: as spool::check_name().
[[nodiscard]] Result<std::unique_ptr<Upload>> open_put(const spool::BlobStore& blobs, const RequestHead& head,
                                                       const std::vector<std::string>& arguments);

}  // namespace qduino::web
