// A socket from which another reader has read too much: the bytes already read come first, then the
// socket goes on.
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

#include <boost/asio/buffer.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core/bind_handler.hpp>
#include <boost/beast/websocket/teardown.hpp>
#include <string>
#include <utility>

namespace qduino::web {

class ResumedSocket {
  public:
    using next_layer_type = boost::asio::ip::tcp::socket;
    using executor_type = next_layer_type::executor_type;

    ResumedSocket(next_layer_type socket, std::string read_already)
        : socket_(std::move(socket)), read_already_(std::move(read_already)) {}

    [[nodiscard]] executor_type get_executor() { return socket_.get_executor(); }
    [[nodiscard]] next_layer_type& next_layer() { return socket_; }

    template <class Buffers, class Handler>
    void async_read_some(const Buffers& buffers, Handler&& handler) {
        if (read_already_.empty()) return socket_.async_read_some(buffers, std::forward<Handler>(handler));
        const std::size_t count =
            boost::asio::buffer_copy(buffers, boost::asio::buffer(std::as_const(read_already_)));
        read_already_.erase(0, count);
        boost::asio::post(get_executor(),
                          boost::beast::bind_front_handler(std::forward<Handler>(handler),
                                                           boost::system::error_code{}, count));
    }
    template <class Buffers, class Handler>
    void async_write_some(const Buffers& buffers, Handler&& handler) {
        socket_.async_write_some(buffers, std::forward<Handler>(handler));
    }

  private:
    next_layer_type socket_;
    std::string read_already_;
};

template <class Handler>
void async_teardown(boost::beast::role_type role, ResumedSocket& socket, Handler&& handler) {
    boost::beast::websocket::async_teardown(role, socket.next_layer(), std::forward<Handler>(handler));
}

}  // namespace qduino::web
