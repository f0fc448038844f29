// The service's side of TLS: OpenSSL on a non-blocking socket, without waiting.
//
// A stranger costs memory before he has shown anything. Asio's own stream holds 68 KB of buffers
// for each connection; OpenSSL alone, which gives its buffers back while nothing is under way,
// holds some 10 KB. So the socket's owner waits (server.cpp), and asks here for the next step.
//
// TLS 1.2 and newer; no renegotiation, no compression, no list of sessions: a returning client
// brings its session along in a ticket.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/result.h"

struct ssl_ctx_st;
struct ssl_st;

namespace qduino::web {

/// A certificate, with those that vouch for it behind it, and its private key.
struct TlsIdentity {
    std::string certificate_pem;
    std::string key_pem;
};

/// What new connections are given. Threads may share it.
class TlsContext {
  public:
    /// Errors: invalid_argument (no certificate, no key, an encrypted key, or a key of another
    /// certificate).
    [[nodiscard]] static Result<std::shared_ptr<TlsContext>> make(const TlsIdentity& identity);

  private:
    friend class TlsSession;
    struct Free {
        void operator()(ssl_ctx_st* context) const;
    };
    std::unique_ptr<ssl_ctx_st, Free> context_;
};

/// The first byte that a client of TLS sends.
inline constexpr unsigned char kTlsFirstByte = 0x16;

/// One connection. The socket is non-blocking, and outlives it.
class TlsSession {
  public:
    enum class Step : std::uint8_t {
        done,
        wants_read,   ///< again, once the socket can be read
        wants_write,  ///< again, with the same bytes, once it can be written
        ended,        ///< the peer has sent its last byte
        failed,
    };
    /// Null: no memory.
    [[nodiscard]] static std::unique_ptr<TlsSession> make(const TlsContext& context, int socket);

    [[nodiscard]] Step handshake();
    /// `count`: bytes read or taken, when done.
    [[nodiscard]] Step read(std::span<char> bytes, std::size_t& count);
    [[nodiscard]] Step write(std::span<const char> bytes, std::size_t& count);
    /// Bytes that were read from the socket already: it may stay silent.
    [[nodiscard]] bool has_pending() const;
    /// Tells the peer that no more will come, if the socket takes that at once.
    void shut();

    static constexpr std::size_t kRecordMax = 16 * 1024;  ///< bytes of one write

  private:
    struct Free {
        void operator()(ssl_st* session) const;
    };
    [[nodiscard]] Step step_of(int returned) const;
    std::unique_ptr<ssl_st, Free> session_;
};

}  // namespace qduino::web
