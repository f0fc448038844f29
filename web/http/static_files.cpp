#include "web/http/static_files.h"

#include <algorithm>
#include <array>
#include <utility>

#include "base/sha256.h"
#include "base/text.h"

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

constexpr std::array<std::pair<Coding, std::string_view>, 2> kEndings{{
    {Coding::gzip, ".gz"},
    {Coding::brotli, ".br"},
}};

/// True when `name` is another file's name with a coding's ending.
template <typename Found>
bool is_coded_form(std::string_view name, const Found& found) {
    return std::any_of(kEndings.begin(), kEndings.end(), [&](const auto& each) {
        return name.ends_with(each.second) &&
               found.contains(name.substr(0, name.size() - each.second.size()));
    });
}

}  // namespace

std::string_view content_type_of(std::string_view name) {
    for (const auto& [extension, type] : kContentTypes) {
        if (name.ends_with(extension)) return type;
    }
    return "application/octet-stream";
}

StaticFiles::StaticFiles(const Found& found) {
    for (const auto& [name, bytes] : found) {
        if (!is_coded_form(name, found)) files_[name] = file_of(name, found);
    }
}

/// `name` and the coded forms beside it. A form that is no smaller is left out.
StaticFiles::File StaticFiles::file_of(const std::string& name, const Found& found) {
    File file;
    file.content_type = content_type_of(name);
    file.immutable = name.starts_with("assets/");
    const std::shared_ptr<const std::string>& plain = found.find(name)->second;
    BareSha256 of_all;
    of_all.add(*plain);
    const std::string hash = of_all.finish().substr(0, 16);
    file.variants[0] = {"\"" + hash + "\"", plain};
    for (const auto& [coding, ending] : kEndings) {
        const auto at = found.find(name + std::string{ending});
        if (at == found.end() || at->second->size() >= plain->size()) continue;
        file.variants[static_cast<std::size_t>(coding)] = {
            text<std::string>('"', hash, '-', word_of(coding), '"'), at->second};
    }
    return file;
}

std::optional<Response> StaticFiles::find(const RequestHead& head) const {
    std::string name;
    for (const std::string& segment : head.path) name += (name.empty() ? "" : "/") + segment;
    if (name.empty()) name = "index.html";
    const auto at = files_.find(name);
    if (at == files_.end()) return std::nullopt;
    const File& file = at->second;
    std::array<bool, kCodings> there{};
    for (std::size_t i = 0; i < kCodings; ++i) there[i] = file.variants[i].bytes != nullptr;
    const Coding coding = choose_coding(head.value("Accept-Encoding"), there);
    const Variant& variant = file.variants[static_cast<std::size_t>(coding)];
    Response response;
    response.content_type = file.content_type;
    response.add("ETag", variant.etag);
    response.add("Cache-Control", file.immutable ? "public, max-age=31536000, immutable" : "no-cache");
    // On the plain form, too: a cache must ask for another client's coding.
    if (there[1] || there[2]) response.add("Vary", "Accept-Encoding");
    if (names_etag(head.value("If-None-Match"), variant.etag)) {
        response.status = 304;
        return response;
    }
    if (coding != Coding::identity) response.add("Content-Encoding", std::string{word_of(coding)});
    response.shared = variant.bytes;
    return response;
}

}  // namespace qduino::web
