#include "web/http/request_reader.h"

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/beast/http/basic_parser.hpp>
#include <boost/beast/http/error.hpp>
#include <utility>

#include "base/contract.h"

namespace qduino::web {

namespace http = boost::beast::http;
using boost::beast::error_code;
using boost::beast::string_view;

namespace {

Method method_of(http::verb verb) {
    using Known = std::pair<http::verb, Method>;
    static constexpr Known kKnown[] = {
        {http::verb::get, Method::get},     {http::verb::head, Method::head},
        {http::verb::post, Method::post},   {http::verb::put, Method::put},
        {http::verb::patch, Method::patch}, {http::verb::delete_, Method::remove}};
    const auto* const at = std::ranges::find(kKnown, verb, &Known::first);
    return at == std::end(kKnown) ? Method::other : at->second;
}

Error error_of(const error_code& code) {
    if (code == http::error::header_limit) {
        return make_error(ErrorCode::out_of_range, "the request's header is too large");
    }
    if (code == http::error::bad_transfer_encoding) {
        return make_error(ErrorCode::invalid_argument,
                          "the request gives its length and a transfer coding, too");
    }
    if (code == http::error::bad_target) {
        return make_error(ErrorCode::invalid_argument,
                          "the request's address is not well-formed; a % in a file's name is sent as %25");
    }
    return make_error(ErrorCode::invalid_argument, "the request is not well-formed HTTP/1.1");
}

}  // namespace

Response refused_request(const Error& error) {
    if (error.code == ErrorCode::unsupported) return error_response(501, "unsupported", error.message.view());
    const bool large = error.code == ErrorCode::out_of_range;
    return error_response(large ? 431 : 400, "invalid_argument", error.message.view());
}

/// Beast's parser, with its findings put into our own values.
class RequestReader::Parser final : public http::basic_parser<true> {
    friend class http::basic_parser<true>;

  public:
    explicit Parser(const ReadLimits& limits) : limits_(limits) {
        header_limit(static_cast<std::uint32_t>(limits.header_bytes_max));
        body_limit(boost::none);  // who takes the body decides
        eager(false);
    }
    RequestHead head;
    std::string body;
    bool header_given_out = false;

    /// The head asks for a transfer coding that is not understood here.
    bool coding_unknown = false;

    /// Checks what Beast leaves open. Sets `code` when the request must be refused.
    void complete_head(error_code& code) {
        head.keep_alive = keep_alive();
        head.chunked = chunked();
        if (const auto length = content_length()) head.content_length = *length;
        head.expects_continue = equal_ignoring_case(trimmed(head.value("Expect")), "100-continue");
        head.upgrades_to_websocket =
            upgrade() && equal_ignoring_case(trimmed(head.value("Upgrade")), "websocket");
        const auto is_host = [](const Header& header) { return equal_ignoring_case(header.name, "Host"); };
        // HTTP/1.0 needs none. No browser speaks it, so no page of another site is behind it.
        const auto hosts = std::ranges::count_if(head.headers, is_host);
        if (hosts > 1 || (hosts == 0 && !is_old_)) code = http::error::bad_field;
        check_coding(code);
    }

  private:
    /// Beast takes the body of an unknown coding for the next request. With a length beside it, or
    /// in HTTP/1.0, a coding is a smuggler's (RFC 9112 §6.1): the peers disagree about where the
    /// body ends.
    void check_coding(error_code& code) {
        const std::string* coding = head.find("Transfer-Encoding");
        if (!coding) return;
        const auto is_coding = [](const Header& header) {
            return equal_ignoring_case(header.name, "Transfer-Encoding");
        };
        const bool once = std::ranges::count_if(head.headers, is_coding) == 1;
        coding_unknown = !once || !equal_ignoring_case(trimmed(*coding), "chunked");
        if (coding_unknown || !head.chunked) code = http::error::bad_field;
        if (head.find("Content-Length") || is_old_) code = http::error::bad_transfer_encoding;
    }
    void on_request_impl(http::verb verb, string_view, string_view target, int version,
                         error_code& code) override {
        head.method = method_of(verb);
        if (version != 11 && version != 10) code = http::error::bad_version;
        is_old_ = version == 10;
        if (!web::parse_target({target.data(), target.size()}, head)) code = http::error::bad_target;
    }
    void on_response_impl(int, string_view, int, error_code& code) override {
        code = http::error::bad_method;
    }
    void on_field_impl(http::field, string_view name, string_view value, error_code& code) override {
        if (is_header_done()) return;  // trailers are not wanted
        if (head.headers.size() >= limits_.fields_max) code = http::error::header_limit;
        head.headers.push_back({{name.data(), name.size()}, {value.data(), value.size()}});
    }
    void on_header_impl(error_code& code) override { complete_head(code); }
    void on_body_init_impl(boost::optional<std::uint64_t> const&, error_code&) override {}
    std::size_t on_body_impl(string_view bytes, error_code&) override {
        body.append(bytes.data(), bytes.size());
        return bytes.size();
    }
    void on_chunk_header_impl(std::uint64_t, string_view, error_code&) override {}
    std::size_t on_chunk_body_impl(std::uint64_t, string_view bytes, error_code&) override {
        body.append(bytes.data(), bytes.size());
        return bytes.size();
    }
    void on_finish_impl(error_code&) override {}

    ReadLimits limits_;
    bool is_old_ = false;  // HTTP/1.0
};

RequestReader::RequestReader(ReadLimits limits)
    : limits_(limits), parser_(std::make_unique<Parser>(limits)) {}
RequestReader::~RequestReader() = default;

const RequestHead& RequestReader::head() const { return parser_->head; }

bool RequestReader::idle() const { return !parser_->got_some() && used_ == pending_.size(); }

void RequestReader::feed(std::span<const char> bytes) {
    drop_used();
    pending_.append(bytes.data(), bytes.size());
}

/// Gives the memory back when all of it was used: most connections wait, and there may be hundreds.
void RequestReader::drop_used() {
    if (used_ == pending_.size()) {
        std::string{}.swap(pending_);
    } else {
        pending_.erase(0, used_);
    }
    used_ = 0;
}

std::string RequestReader::take_rest() {
    std::string rest = pending_.substr(used_);
    pending_.clear();
    used_ = 0;
    return rest;
}

void RequestReader::next() {
    QDUINO_EXPECT(parser_->is_done());
    parser_ = std::make_unique<Parser>(limits_);
}

Result<RequestReader::Progress> RequestReader::advance(std::string& body) {
    body.clear();
    parser_->body.clear();
    for (int idle_steps = 0;
         idle_steps < 8;) {  // Beast steps between its states without using bytes, but not for ever
        if (parser_->is_header_done() && !parser_->header_given_out) {
            parser_->header_given_out = true;
            return Progress::head;
        }
        if (parser_->is_done()) {
            if (parser_->body.empty()) return Progress::complete;
            break;
        }
        if (used_ == pending_.size()) break;
        error_code code;
        const std::size_t count =
            parser_->put(boost::asio::buffer(pending_.data() + used_, pending_.size() - used_), code);
        used_ += count;
        idle_steps = count == 0 ? idle_steps + 1 : 0;
        if (code == http::error::need_more) break;
        if (code == http::error::bad_field && parser_->coding_unknown)
            return make_error(ErrorCode::unsupported, "of transfer codings only \"chunked\" is known here");
        if (code) return error_of(code);
    }
    if (parser_->body.empty()) {
        if (held_bytes() > limits_.header_bytes_max)
            return make_error(ErrorCode::out_of_range, "the header of a chunk is too large");
        drop_used();
        return Progress::need_more;
    }
    body.swap(parser_->body);
    return Progress::body;
}

}  // namespace qduino::web
