// The page's own files: all there from the start, looked up by name. A request's path never
// meets the file system, and all answers share the bytes.
//
//   app.js   app.js.gz   app.js.br      one file in three codings, made when the page is built. The
//                                       client's Accept-Encoding chooses. Each has an ETag of its
//                                       own: caches must not mix them up.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "web/http/content_coding.h"
#include "web/http/http.h"

namespace qduino::web {

class StaticFiles {
  public:
    /// Bytes by path.
    using Found = std::map<std::string, std::shared_ptr<const std::string>, std::less<>>;

    StaticFiles() = default;
    explicit StaticFiles(const Found& found);

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
