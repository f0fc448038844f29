// HTTP as values: requests and answers. No sockets, no parsing library.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/bytes.h"

namespace qduino::web {

enum class Method : std::uint8_t { get, head, post, put, patch, remove, other };

struct Header {
    std::string name;
    std::string value;
};

/// A request's head. Field values stand as the client sent them: bounded in length and number,
/// otherwise untrusted.
struct RequestHead {
    Method method = Method::other;
    /// Segments, each percent-decoded: a decoded slash stays inside of its segment.
    std::vector<std::string> path;
    std::string query;  ///< behind the `?`, not decoded
    std::vector<Header> headers;
    std::optional<std::uint64_t> content_length;
    bool chunked = false;
    bool keep_alive = true;
    bool expects_continue = false;
    bool upgrades_to_websocket = false;

    /// The first field of this name (any case); null when there is none.
    [[nodiscard]] const std::string* find(std::string_view name) const;
    /// Its value, or nothing.
    [[nodiscard]] std::string_view value(std::string_view name) const;
    [[nodiscard]] bool has_body() const { return chunked || content_length.value_or(0) > 0; }
    /// The value of a parameter of the query, percent-decoded; empty when absent or malformed.
    [[nodiscard]] std::string query_value(std::string_view name) const;
};

/// The sender of a request, and what he calls this service (web/http/forwarded.h).
struct Client {
    std::string name{};    ///< his address, as wrong keys are counted
    bool secure = false;   ///< nobody can read along between him and us, or a proxy of ours
    std::string host{};    ///< the name that he calls, with a port where it has one
    std::string prefix{};  ///< of all paths as he sees them, "/printer"; empty: none

    /// The address of the service as he sees it, without a slash at its end.
    [[nodiscard]] std::string address() const { return (secure ? "https://" : "http://") + host + prefix; }
};

struct Request {
    RequestHead head;
    std::string body;
    Client client;
};

/// A part of a file as an answer's body.
struct FileRange {
    std::shared_ptr<const ByteSource> bytes;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
};

struct Response {
    int status = 200;
    std::string content_type = "application/json";
    std::vector<Header> headers{};
    std::string body{};
    /// Replaces `body`: bytes that many answers have in common.
    std::shared_ptr<const std::string> shared{};
    std::optional<FileRange> file{};  ///< instead of both
    bool close = false;               ///< end the connection after it

    [[nodiscard]] std::uint64_t body_size() const {
        return file ? file->length : shared ? shared->size() : body.size();
    }
    Response& add(std::string name, std::string value) {
        headers.push_back({std::move(name), std::move(value)});
        return *this;
    }
};

/// An error in the form of docs/api.md: {"error":{"code":…,"message":…}}. `message` is ours, never
/// the client's.
[[nodiscard]] Response error_response(int status, std::string_view code, std::string_view message);

/// The head of an answer on the wire, with the fields that every answer carries.
[[nodiscard]] std::string head_bytes(const Response& response, bool keep_alive);

[[nodiscard]] std::string_view reason_of(int status);
[[nodiscard]] bool equal_ignoring_case(std::string_view a, std::string_view b);
[[nodiscard]] constexpr bool is_letter_or_digit(char c) {  // of ASCII
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
[[nodiscard]] std::string_view trimmed(std::string_view text);
/// Takes the text before the first `separator` off `rest`, and the separator with it; all of it
/// when there is none.
std::string_view take_until(std::string_view& rest, char separator);
/// Nothing when a `%` is not followed by two hexadecimal digits, or decodes to NUL.
[[nodiscard]] std::optional<std::string> percent_decoded(std::string_view text);
/// Splits a target into `head.path` and `head.query`. False when it is no absolute path, or
/// malformed.
[[nodiscard]] bool parse_target(std::string_view target, RequestHead& head);

/// The key that a request presents, in X-Api-Key or as a Bearer in Authorization; nothing when it
/// presents none.
[[nodiscard]] std::optional<std::string_view> presented_key(const RequestHead& head);

/// The cookie of a browser's session.
inline constexpr std::string_view kSessionCookie = "qduino_session";

/// The value of one cookie in a Cookie field; empty when absent.
[[nodiscard]] std::string_view cookie_value(std::string_view cookies, std::string_view name);

}  // namespace qduino::web
