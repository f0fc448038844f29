#include "web/http/http.h"

#include <algorithm>
#include <boost/beast/core/string.hpp>
#include <utility>

#include "base/text.h"
#include "base/whole_number.h"

namespace qduino::web {

namespace {

constexpr std::size_t kSegmentsMax = 16;

// The page needs no inline script, no foreign origin, no frame; charts set styles on elements.
constexpr std::string_view kContentSecurityPolicy =
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

}  // namespace

bool equal_ignoring_case(std::string_view a, std::string_view b) {
    return boost::beast::iequals({a.data(), a.size()}, {b.data(), b.size()});
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank = " \t";
    const std::size_t first = text.find_first_not_of(kBlank);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::string_view take_until(std::string_view& rest, char separator) {
    const std::string_view taken = rest.substr(0, rest.find(separator));
    rest.remove_prefix(std::min(rest.size(), taken.size() + 1));
    return taken;
}

std::optional<std::string> percent_decoded(std::string_view text) {
    std::string decoded;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        if (i + 2 >= text.size()) return std::nullopt;
        const auto byte = whole_number<unsigned char>(text.substr(i + 1, 2), 16);
        if (byte.value_or(0) == 0) return std::nullopt;
        decoded += static_cast<char>(*byte);
        i += 2;
    }
    return decoded;
}

bool parse_target(std::string_view target, RequestHead& head) {
    if (!target.starts_with('/')) return false;
    std::string_view path = take_until(target, '?').substr(1);
    head.query = target;
    head.path.clear();
    for (bool last = false; !last;) {
        last = path.find('/') == std::string_view::npos;
        const std::optional<std::string> segment = percent_decoded(take_until(path, '/'));
        if (!segment || head.path.size() >= kSegmentsMax) return false;
        head.path.push_back(*segment);
    }
    return true;
}

const std::string* RequestHead::find(std::string_view name) const {
    for (const Header& header : headers) {
        if (equal_ignoring_case(header.name, name)) return &header.value;
    }
    return nullptr;
}

std::string_view RequestHead::value(std::string_view name) const {
    const std::string* found = find(name);
    return found ? std::string_view{*found} : std::string_view{};
}

std::string RequestHead::query_value(std::string_view name) const {
    for (std::string_view rest = query; !rest.empty();) {
        std::string_view value = take_until(rest, '&');
        const bool assigned = value.find('=') != std::string_view::npos;
        if (take_until(value, '=') == name && assigned) return percent_decoded(value).value_or("");
    }
    return {};
}

std::string_view reason_of(int status) {
    static constexpr std::pair<int, std::string_view> kReasons[] = {
        {200, "OK"},
        {201, "Created"},
        {202, "Accepted"},
        {204, "No Content"},
        {304, "Not Modified"},
        {400, "Bad Request"},
        {401, "Unauthorized"},
        {403, "Forbidden"},
        {404, "Not Found"},
        {405, "Method Not Allowed"},
        {408, "Request Timeout"},
        {409, "Conflict"},
        {411, "Length Required"},
        {413, "Content Too Large"},
        {415, "Unsupported Media Type"},
        {422, "Unprocessable Content"},
        {429, "Too Many Requests"},
        {431, "Request Header Fields Too Large"},
        {500, "Internal Server Error"},
        {501, "Not Implemented"},
        {503, "Service Unavailable"},
        {507, "Insufficient Storage"},
    };
    for (const auto& [number, reason] : kReasons) {
        if (number == status) return reason;
    }
    return "Status";
}

Response error_response(int status, std::string_view code, std::string_view message) {
    // Codes and messages are this program's own words: only these characters need escaping.
    std::string escaped;
    for (const char c : message) {
        if (c == '"' || c == '\\') escaped += '\\';
        escaped += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
    }
    return {.status = status,
            .body = text<std::string>(R"({"error":{"code":")", code, R"(","message":")", escaped, R"("}})")};
}

std::string head_bytes(const Response& response, bool keep_alive) {
    std::string head =
        text<std::string>("HTTP/1.1 ", response.status, ' ', reason_of(response.status), "\r\n");
    const auto field = [&head](std::string_view name, const auto& value) {
        write(head, name, ": ", value, "\r\n");
    };
    if (response.status != 204 && response.status != 304) {
        field("Content-Length", response.body_size());
        field("Content-Type", response.content_type);
    }
    field("Connection", keep_alive ? "keep-alive" : "close");
    field("X-Content-Type-Options", "nosniff");
    field("Content-Security-Policy", kContentSecurityPolicy);
    field("Referrer-Policy", "no-referrer");
    field("X-Frame-Options", "DENY");
    field("Cross-Origin-Opener-Policy", "same-origin");
    field("Cross-Origin-Resource-Policy", "same-origin");
    bool caches = false;
    for (const Header& header : response.headers) {
        caches = caches || equal_ignoring_case(header.name, "Cache-Control");
        field(header.name, header.value);
    }
    if (!caches) field("Cache-Control", "no-store");
    head.append("\r\n");
    return head;
}

std::optional<std::string_view> presented_key(const RequestHead& head) {
    if (const std::string* key = head.find("X-Api-Key")) return *key;
    constexpr std::string_view kScheme = "Bearer ";
    const std::string_view value = head.value("Authorization");
    if (value.size() <= kScheme.size() || !equal_ignoring_case(value.substr(0, kScheme.size()), kScheme))
        return std::nullopt;
    return trimmed(value.substr(kScheme.size()));
}

std::string_view cookie_value(std::string_view cookies, std::string_view name) {
    while (!cookies.empty()) {
        std::string_view value = trimmed(take_until(cookies, ';'));
        const bool assigned = value.find('=') != std::string_view::npos;
        if (take_until(value, '=') == name && assigned) return value;
    }
    return {};
}

}  // namespace qduino::web
