// One upload into memory: the body of a request becomes a file's bytes, its hash, and the fields
// that came with it. As web/upload.h does it with files.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "apps/metal_printer/memory_spool.h"
#include "base/sha256.h"
#include "web/http/http.h"
#include "web/http/multipart.h"

namespace qduino::apps::metal {

class MemoryUpload final : private web::MultipartSink {
  public:
    /// The file goes to `place`.
    explicit MemoryUpload(FileBytes place) { upload_.bytes = std::move(place); }

    /// `place`: its memory; null: there is none. `name` empty: a multipart body, which says the
    /// name; else the body is the file. Error: invalid_argument, unsupported, out_of_range (longer
    /// than a place), unavailable.
    [[nodiscard]] static Result<std::unique_ptr<MemoryUpload>> open(const web::RequestHead& head,
                                                                    const std::string& name, FileBytes place);

    /// Body bytes in order. Errors: invalid_argument, out_of_range (too long).
    [[nodiscard]] Result<void> take(std::span<const char> bytes);
    /// The body has ended. Errors: invalid_argument; corrupt (another SHA-256 than declared).
    [[nodiscard]] Result<Uploaded> finish();

  private:
    [[nodiscard]] Result<void> part_begin(const web::PartHead& head) override;
    [[nodiscard]] Result<void> part_data(std::span<const char> bytes) override;
    [[nodiscard]] Result<void> part_end() override { return {}; }
    [[nodiscard]] Result<void> add(std::span<const char> bytes);

    Uploaded upload_;
    BareSha256 hash_;
    std::map<std::string, std::string> fields_;
    std::optional<web::MultipartParser> parser_;
    std::string* field_ = nullptr;  // that is coming in; null: the file
};

}  // namespace qduino::apps::metal
