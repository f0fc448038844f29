// One upload: body bytes → a staged file, the fields that came with it, and a verdict. No sockets;
// runs on worker threads, on one at a time.
//
//   raw (PUT):     body ───────────────────────────► StagedFile ─► Analyzer: refuses as it reads
//   multipart:     body ─► MultipartParser ─┬ file ─► StagedFile ─► …
//                                           └ other parts ─► fields (small, bounded)
//
// take() is the disk's work and judge() the analysis': a piece is taken, judged, and only then is
// the next one received.
//
// Nothing is queued from here. A file that was not sealed is removed when the upload is destroyed.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "spool/analyzer.h"
#include "spool/files.h"
#include "web/http/http.h"
#include "web/http/multipart.h"

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

    /// Shows `analyzer` what take() has added to the file since the last call. A refusal comes back
    /// as soon as it stands, whatever may follow.
    [[nodiscard]] std::optional<spool::Analysis> judge(spool::Analyzer& analyzer);
    /// The verdict on the whole file. Once, after finish(). Errors: as the analyzer's.
    [[nodiscard]] Result<spool::Analysis> verdict(spool::Analyzer& analyzer);

    /// The file is from now on `lines` and what was received. After finish(). Errors: as take().
    [[nodiscard]] Result<void> put_before(const std::string& lines);
    /// Reads the whole file anew. After put_before(). Errors: as the analyzer's.
    [[nodiscard]] Result<spool::Analysis> analyze(spool::Analyzer& analyzer);
    /// Removes what was received. Call it before a refusal is answered: a client that reads the
    /// answer then finds nothing left behind.
    void discard() {
        reading_.reset();
        file_.reset();
    }

    /// Whole after finish().
    [[nodiscard]] spool::StagedFile& file() { return *file_; }
    [[nodiscard]] const std::string& name() const { return name_; }
    /// A field that came along; empty when absent.
    [[nodiscard]] std::string field(const std::string& name) const;
    [[nodiscard]] std::uint64_t received() const { return file_ ? file_->size() : 0; }

  protected:
    explicit Upload(spool::Files& files) : files_(files) {}
    [[nodiscard]] virtual Result<void> end() = 0;
    [[nodiscard]] Result<void> begin_file(std::string name);
    [[nodiscard]] Result<void> write_file(std::span<const char> bytes);

    spool::Files& files_;
    std::unique_ptr<spool::StagedFile> file_;
    std::unique_ptr<spool::FileReading> reading_;
    std::string unread_;  // written, and not yet judged: a piece at most
    std::string name_;
    std::map<std::string, std::string> fields_;
};

/// Slicers' dialogues offer a folder in front of the name. There are no folders here: it becomes a
/// part of the name, `lids/box.gcode` → `lids - box.gcode`. Errors: invalid_argument (it leads
/// elsewhere), and as spool::check_name().
[[nodiscard]] Result<std::string> name_in_folder(std::string_view folder, std::string_view name);

/// POST with multipart/form-data, one part of which is `file`. Errors: as boundary_of().
[[nodiscard]] Result<std::unique_ptr<Upload>> open_multipart(spool::Files& files, const RequestHead& head,
                                                             const std::vector<std::string>& arguments);

/// PUT whose body is the file; its name, perhaps behind folders, is the last of `arguments`.
/// Errors: as name_in_folder().
[[nodiscard]] Result<std::unique_ptr<Upload>> open_put(spool::Files& files, const RequestHead& head,
                                                       const std::vector<std::string>& arguments);

}  // namespace qduino::web
