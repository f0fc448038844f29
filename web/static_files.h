// The page's own files: listed and read once at start, looked up by name. A request's path never
// meets the file system, and all answers share the bytes.
//
//   app.js   app.js.gz   app.js.br      one file in three codings, made when the page is built. The
//                                       client's Accept-Encoding chooses. Each has an ETag of its
//                                       own: caches must not mix them up.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "base/result.h"
#include "web/content_coding.h"
#include "web/http.h"

namespace qduino::web {

class StaticFiles {
  public:
    static constexpr std::size_t kFilesMax = 2000;
    static constexpr std::uint64_t kBytesMax = std::uint64_t{32} << 20;

    /// Bytes by path.
    using Found = std::map<std::string, std::shared_ptr<const std::string>, std::less<>>;

    StaticFiles() = default;
    explicit StaticFiles(const Found& found);
    /// Reads every regular file below `folder` (web/static_folder.cpp); links are not followed.
    /// Errors: not_found, out_of_range (too many).
    [[nodiscard]] static Result<StaticFiles> read(const std::filesystem::path& folder);

    /// The file in the client's coding, or 304 when the client has it; nothing when there is none
    /// of this name. The empty path is index.html.
    [[nodiscard]] std::optional<Response> find(const RequestHead& head) const;
    [[nodiscard]] std::size_t size() const { return files_.size(); }

  private:
    struct Variant {
        std::string etag;
        std::shared_ptr<const std::string> bytes;  ///< null: not in this coding
    };
    struct File {
        std::string content_type;
        std::array<Variant, kCodings> variants;
        bool immutable = false;  ///< its name holds its hash: it never changes
    };
    [[nodiscard]] static File file_of(const std::string& name, const Found& found);

    std::map<std::string, File, std::less<>> files_;  // by path, "assets/index-1f2e.js"
};

/// The extension decides. An unknown one gives application/octet-stream.
[[nodiscard]] std::string_view content_type_of(std::string_view name);

}  // namespace qduino::web
