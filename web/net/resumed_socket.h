// A socket from which another reader has read too much: the bytes already read come first, then the
// socket goes on, with TLS or without.
//
//     client sends   GET /api/v1/live … ⏎⏎ | ping frame | …
//     HTTP reads     ──────────────────────────────►|            one read takes what has arrived
//     the stream     takes what lies behind the head, then reads from the socket itself
//
// RFC 6455 §4.1 has a client wait for the answer before its first frame. A client that does not
// wait is understood, too: without its first bytes every later frame would be misread.
//
// It has only the functions that Boost.Beast asks of the layer below a WebSocket. Boost's headers
// are heavy, so server.cpp alone includes this.
#pragma once

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/error.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <memory>
#include <string>
#include <utility>

#include "web/net/tls.h"

namespace qduino::web {

/// A non-blocking socket, and its TLS; null: none.
struct Wire {
    boost::asio::ip::tcp::socket socket;
    std::unique_ptr<TlsSession> tls;
};

class ResumedSocket {
  public:
    using next_layer_type = boost::asio::ip::tcp::socket;
    using executor_type = next_layer_type::executor_type;

    ResumedSocket(Wire wire, std::string read_already)
        : wire_(std::move(wire)), read_already_(std::move(read_already)) {}

    [[nodiscard]] executor_type get_executor() { return wire_.socket.get_executor(); }
    [[nodiscard]] next_layer_type& next_layer() { return wire_.socket; }
    /// Tells the peer of a TLS that no more will come.
    void shut() {
        if (wire_.tls) wire_.tls->shut();
    }

    template <class Buffers, class Handler>
    void async_read_some(const Buffers& buffers, Handler&& handler) {
        if (!read_already_.empty()) {
            const std::size_t count =
                boost::asio::buffer_copy(buffers, boost::asio::buffer(std::as_const(read_already_)));
            read_already_.erase(0, count);
            return done_soon(std::forward<Handler>(handler), {}, count);
        }
        if (!wire_.tls) return wire_.socket.async_read_some(buffers, std::forward<Handler>(handler));
        const boost::asio::mutable_buffer into = first_of<boost::asio::mutable_buffer>(buffers);
        step_tls(
            [tls = wire_.tls.get(), into](std::size_t& count) {
                return tls->read({static_cast<char*>(into.data()), into.size()}, count);
            },
            std::forward<Handler>(handler), true);
    }
    template <class Buffers, class Handler>
    void async_write_some(const Buffers& buffers, Handler&& handler) {
        if (!wire_.tls) return wire_.socket.async_write_some(buffers, std::forward<Handler>(handler));
        const boost::asio::const_buffer from = first_of<boost::asio::const_buffer>(buffers);
        const std::size_t size = std::min(from.size(), TlsSession::kRecordMax);
        step_tls(
            [tls = wire_.tls.get(), from, size](std::size_t& count) {
                return tls->write({static_cast<const char*>(from.data()), size}, count);
            },
            std::forward<Handler>(handler), true);
    }

  private:
    using ErrorCode = boost::system::error_code;

    /// The first buffer of a sequence that is not empty.
    template <class Buffer, class Buffers>
    static Buffer first_of(const Buffers& buffers) {
        for (auto at = boost::asio::buffer_sequence_begin(buffers);
             at != boost::asio::buffer_sequence_end(buffers); ++at)
            if (Buffer{*at}.size() > 0) return *at;
        return {};
    }
    /// Never from within the call that has begun the operation.
    template <class Handler>
    void done_soon(Handler&& handler, ErrorCode failed, std::size_t count) {
        boost::asio::post(get_executor(),
                          boost::beast::bind_front_handler(std::forward<Handler>(handler), failed, count));
    }
    /// Tries `step` until it needs no more of the socket. `first`: within the call that has begun
    /// it.
    template <class Step, class Handler>
    void step_tls(Step step, Handler&& handler, bool first) {
        std::size_t count = 0;
        ErrorCode failed;
        const TlsSession::Step taken = step(count);
        if (taken == TlsSession::Step::wants_read || taken == TlsSession::Step::wants_write) {
            const auto event = taken == TlsSession::Step::wants_read ? next_layer_type::wait_read
                                                                     : next_layer_type::wait_write;
            return wire_.socket.async_wait(
                event, [this, step, handler = std::decay_t<Handler>(std::forward<Handler>(handler))](
                           const ErrorCode& broken) mutable {
                    if (broken) return handler(broken, 0);
                    step_tls(std::move(step), std::move(handler), false);
                });
        }
        if (taken == TlsSession::Step::ended) failed = boost::asio::error::eof;
        if (taken == TlsSession::Step::failed) failed = boost::asio::error::connection_reset;
        if (first) return done_soon(std::forward<Handler>(handler), failed, count);
        handler(failed, count);
    }

    Wire wire_;
    std::string read_already_;
};

template <class Handler>
void async_teardown(boost::beast::role_type role, ResumedSocket& socket, Handler&& handler) {
    socket.shut();
    boost::beast::websocket::async_teardown(role, socket.next_layer(), std::forward<Handler>(handler));
}

}  // namespace qduino::web
