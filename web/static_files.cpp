#include "web/static_files.h"

#include <array>
#include <fstream>
#include <iterator>
#include <utility>

#include "spool/sha256.h"

namespace qduino::web {

namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 14> kContentTypes{{
    {".html", "text/html; charset=utf-8"},
    {".js", "text/javascript; charset=utf-8"},
    {".css", "text/css; charset=utf-8"},
    {".json", "application/json"},
    {".map", "application/json"},
    {".svg", "image/svg+xml"},
    {".png", "image/png"},
    {".ico", "image/x-icon"},
    {".webp", "image/webp"},
    {".woff2", "font/woff2"},
    {".wasm", "application/wasm"},
    {".txt", "text/plain; charset=utf-8"},
    {".webmanifest", "application/manifest+json"},
    {".jpg", "image/jpeg"},
}};

}  // namespace

std::string_view content_type_of(std::string_view name) {
    for (const auto& [extension, type] : kContentTypes) {
        if (name.ends_with(extension)) return type;
    }
    return "application/octet-stream";
}

Result<StaticFiles> StaticFiles::read(const std::filesystem::path& folder) {
    StaticFiles found;
    std::uint64_t total = 0;
    std::error_code failed;
    for (const auto& entry : std::filesystem::recursive_directory_iterator{folder, failed}) {
        if (entry.is_symlink() || !entry.is_regular_file()) continue;
        std::ifstream stream{entry.path(), std::ios::binary};
        File file;
        file.bytes.assign(std::istreambuf_iterator<char>{stream}, {});
        total += file.bytes.size();
        if (!stream || total > kBytesMax || found.files_.size() >= kFilesMax) {
            return make_error(ErrorCode::out_of_range,
                              "the page's files are too many, too large or not readable");
        }
        const std::string name = std::filesystem::relative(entry.path(), folder).generic_string();
        file.content_type = content_type_of(name);
        file.etag = "\"" + spool::sha256_of(file.bytes).substr(0, 16) + "\"";
        file.immutable = name.starts_with("assets/");
        found.files_[name] = std::move(file);
    }
    if (failed) {
        return Error{ErrorCode::not_found,
                     FixedString<236>{"no folder of the page's files: "}.append(folder.native())};
    }
    return found;
}

std::optional<Response> StaticFiles::find(const RequestHead& head) const {
    std::string name;
    for (const std::string& segment : head.path) name += (name.empty() ? "" : "/") + segment;
    if (name.empty()) name = "index.html";
    const auto at = files_.find(name);
    if (at == files_.end()) return std::nullopt;
    const File& file = at->second;
    Response response;
    response.content_type = file.content_type;
    response.add("ETag", file.etag);
    response.add("Cache-Control", file.immutable ? "public, max-age=31536000, immutable" : "no-cache");
    if (head.value("If-None-Match") == file.etag) {
        response.status = 304;
    } else {
        response.body = file.bytes;
    }
    return response;
}

}  // namespace qduino::web
