// Bytes of a connection → requests. Sans I/O: bytes go in as they come, in any pieces; heads and bodies come out.
//
//     feed(bytes) … advance() → head      the caller decides what to do with the body, then goes on
//                   advance() → body      again and again; each hands out what has arrived
//                   advance() → complete  next() begins with the next request, which may have arrived already
//
// The grammar is Boost.Beast's parser; bounds and strictness are decided here: header size and number, one Host,
// Content-Length and Transfer-Encoding never together, targets that are absolute paths. What is held is one feed and one
// header's length at most: Beast bounds a head, but neither the line before a chunk nor what follows the last one.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/result.h"
#include "web/http.h"

namespace qduino::web {

struct ReadLimits {
    std::size_t header_bytes_max = 16 * 1024;
    std::size_t fields_max = 100;
};

class RequestReader {
  public:
    enum class Progress : std::uint8_t { need_more, head, body, complete };

    explicit RequestReader(ReadLimits limits = {});
    ~RequestReader();
    RequestReader(const RequestReader&) = delete;
    RequestReader& operator=(const RequestReader&) = delete;

    /// Bytes as they came from the peer.
    void feed(std::span<const char> bytes);
    /// One step. `body` is replaced by what a body step yields. Errors (the connection is beyond repair): invalid_argument
    /// (no HTTP), out_of_range (header too large), unsupported (a coding that is not known).
    [[nodiscard]] Result<Progress> advance(std::string& body);
    /// Forgets the request that is complete. Contract: it is.
    void next();

    /// From the `head` step on.
    [[nodiscard]] const RequestHead& head() const;
    /// Bytes fed and not yet used: to be handed on when the connection changes its protocol.
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
