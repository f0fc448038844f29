#include "web/http.h"

#include <algorithm>
#include <array>
#include <utility>

namespace qduino::web {

namespace {

constexpr std::size_t kSegmentsMax = 16;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

int hex_digit(char c) {
    if (c >= '0' && c <= '9') return c - '0';
    if (c >= 'a' && c <= 'f') return c - 'a' + 10;
    if (c >= 'A' && c <= 'F') return c - 'A' + 10;
    return -1;
}

// The page needs no inline script, no foreign origin, no frame; charts set styles on elements.
constexpr std::string_view kContentSecurityPolicy =
    "default-src 'self'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; worker-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'";

}  // namespace

bool equal_ignoring_case(std::string_view a, std::string_view b) {
    return a.size() == b.size() &&
           std::equal(a.begin(), a.end(), b.begin(), [](char x, char y) { return lower(x) == lower(y); });
}

std::string_view trimmed(std::string_view text) {
    constexpr std::string_view kBlank = " \t";
    const std::size_t first = text.find_first_not_of(kBlank);
    if (first == std::string_view::npos) return {};
    return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::optional<std::string> percent_decoded(std::string_view text) {
    std::string decoded;
    for (std::size_t i = 0; i < text.size(); ++i) {
        if (text[i] != '%') {
            decoded += text[i];
            continue;
        }
        if (i + 2 >= text.size()) return std::nullopt;
        const int high = hex_digit(text[i + 1]);
        const int low = hex_digit(text[i + 2]);
        if (high < 0 || low < 0 || high + low == 0) return std::nullopt;
        decoded += static_cast<char>(high * 16 + low);
        i += 2;
    }
    return decoded;
}

bool parse_target(std::string_view target, RequestHead& head) {
    if (target.empty() || target.front() != '/') return false;
    const std::size_t question = target.find('?');
    if (question != std::string_view::npos) head.query = target.substr(question + 1);
    std::string_view path = target.substr(1, question == std::string_view::npos ? question : question - 1);
    head.path.clear();
    while (true) {
        const std::size_t slash = path.find('/');
        const std::optional<std::string> segment = percent_decoded(path.substr(0, slash));
        if (!segment || head.path.size() >= kSegmentsMax) return false;
        head.path.push_back(*segment);
        if (slash == std::string_view::npos) return true;
        path.remove_prefix(slash + 1);
    }
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
    std::string_view rest = query;
    while (!rest.empty()) {
        const std::size_t end = rest.find('&');
        const std::string_view pair = rest.substr(0, end);
        const std::size_t equals = pair.find('=');
        if (equals != std::string_view::npos && pair.substr(0, equals) == name) {
            return percent_decoded(pair.substr(equals + 1)).value_or("");
        }
        if (end == std::string_view::npos) break;
        rest.remove_prefix(end + 1);
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
    Response response;
    response.status = status;
    response.body =
        std::string{R"({"error":{"code":")"}.append(code).append(R"(","message":")").append(escaped);
    response.body += R"("}})";
    return response;
}

std::string head_bytes(const Response& response, bool keep_alive) {
    std::string head = "HTTP/1.1 " + std::to_string(response.status) + " ";
    head.append(reason_of(response.status)).append("\r\n");
    const auto field = [&head](std::string_view name, std::string_view value) {
        head.append(name).append(": ").append(value).append("\r\n");
    };
    if (response.status != 204 && response.status != 304) {
        field("Content-Length", std::to_string(response.body_size()));
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

}  // namespace qduino::web
