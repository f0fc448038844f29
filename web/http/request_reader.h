// Bytes of a connection → requests. Sans I/O: bytes go in in any pieces; heads and bodies come out.
//
//     feed(bytes) … advance() → head      the caller decides what to do with the body, and goes on
//                   advance() → body      again and again; each hands out what has arrived
//                   advance() → complete  next() begins with the next request, which may be here
//
// The grammar is Boost.Beast's parser. This class decides bounds and strictness: size and number of
// header fields, one Host, never Content-Length together with Transfer-Encoding, no transfer coding
// but "chunked", absolute paths as targets. Beast bounds a head, but neither the line before a
// chunk nor the trailer of the last one. So the reader holds at most one feed and one header's
// length.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/result.h"
#include "web/http/http.h"

namespace qduino::web {

struct ReadLimits {
    std::size_t header_bytes_max = 16 * 1024;
    std::size_t fields_max = 100;
};

/// The answer to bytes that are no request, by the error of RequestReader::advance(). The
/// connection ends with it.
[[nodiscard]] Response refused_request(const Error& error);

class RequestReader {
  public:
    enum class Progress : std::uint8_t { need_more, head, body, complete };

    explicit RequestReader(ReadLimits limits = {});
    ~RequestReader();
    RequestReader(const RequestReader&) = delete;
    RequestReader& operator=(const RequestReader&) = delete;

    /// Bytes from the peer, in order.
    void feed(std::span<const char> bytes);
    /// One step. A body step replaces `body` by its bytes. Errors (the connection is beyond
    /// repair): invalid_argument (no HTTP), out_of_range (header too large), unsupported (an
    /// unknown coding).
    [[nodiscard]] Result<Progress> advance(std::string& body);
    /// Forgets the request that is complete. Contract: it is.
    void next();

    /// Known from the `head` step on.
    [[nodiscard]] const RequestHead& head() const;
    /// Bytes fed and not yet used: for the owner of a connection that changes its protocol.
    [[nodiscard]] std::string take_rest();
    /// Bytes fed and not yet used.
    [[nodiscard]] std::size_t held_bytes() const { return pending_.size() - used_; }
    /// True between requests, when nothing of the next has arrived.
    [[nodiscard]] bool idle() const;

  private:
    class Parser;
    void drop_used();
    ReadLimits limits_;
    std::unique_ptr<Parser> parser_;
    std::string pending_;
    std::size_t used_ = 0;  // of pending_
};

}  // namespace qduino::web
