// One HTTP/1.1 connection without its socket: bytes in, bytes out, and what it waits for.
//
//            ┌───────────────────────────── keep-alive ─────────────────────────────┐
//            ▼                                                                      │
//   head ──► plan ─┬─ respond ───────────────────────────────► (answer) ──► next ───┤
//                  ├─ collect ──► body ──► handle ──► replying ──► (answer) ────────┘
//                  ├─ upload ───► piece ⇄ disk ──► end ──► replying ──► (answer) …
//                  ├─ live ─────► the socket's owner takes over
//                  └─ refused with a body unread ──► (answer) ──► draining ──► closed
//
// Back pressure: while a piece is with the disk, or an answer is awaited, no input is wanted. So a connection holds one read's
// worth of bytes, however long its upload. Every state has a deadline: a peer that sends a byte a minute is dropped.
//
// I/O thread only. Answers that come later keep the connection alive until they have come (shared from this).
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "web/request_reader.h"
#include "web/service.h"

namespace qduino::web {

struct ConnectionLimits {
    ReadLimits read;
    Nanoseconds head_time = std::chrono::seconds{15};   ///< from a head's first byte to its last
    Nanoseconds idle_time = std::chrono::seconds{75};   ///< between requests
    Nanoseconds body_gap = std::chrono::seconds{30};    ///< between two pieces of a body
    Nanoseconds body_grace = std::chrono::seconds{60};  ///< after it a body has to come at …
    double body_rate_min = 1024;                        ///< … this many bytes a second on average
    Nanoseconds drain_time = std::chrono::seconds{5};   ///< for a refused body to be sent and thrown away
};

class Connection : public std::enable_shared_from_this<Connection> {
  public:
    struct Output {
        std::string bytes;
        std::optional<FileRange> file;  ///< to be sent behind `bytes`
    };

    /// `wake` is called when an answer has come and there may be something to do.
    Connection(Service& service, std::string remote, std::function<void()> wake, Moment moment,
               ConnectionLimits limits = {});

    /// Bytes from the peer. Only while wants_input().
    void receive(std::span<const char> bytes, Moment moment);
    /// The peer has sent its last byte.
    void receive_end();
    /// Time has passed: deadlines.
    void check_time(Moment moment);

    [[nodiscard]] bool wants_input() const;
    /// The next bytes to send, in order; nothing when there are none now.
    [[nodiscard]] std::optional<Output> take_output();
    /// Nothing more will come out; once all outputs are sent, the sending side is to be shut.
    [[nodiscard]] bool wants_close() const { return state_ == State::draining || state_ == State::closed; }
    /// Nothing more is wanted from the peer either.
    [[nodiscard]] bool is_closed() const { return state_ == State::closed; }
    /// The request of a live stream that was admitted: the connection is its owner's now.
    [[nodiscard]] bool is_live() const { return state_ == State::live; }
    [[nodiscard]] const RequestHead& head() const { return reader_.head(); }
    /// Between requests: may be dropped to make room.
    [[nodiscard]] bool is_idle() const { return state_ == State::head && reader_.idle(); }

  private:
    enum class State : std::uint8_t { head, collecting, uploading, replying, draining, live, closed };

    void advance();
    bool step();
    void on_head();
    void on_body(std::string bytes);
    void on_complete();
    void send_piece(std::string bytes);
    void piece_done(const Result<void>& taken);
    void report_progress();
    void close_cut_short();
    void drop_upload();
    [[nodiscard]] Reply reply_later();
    void answer(Response response);
    /// Answers although not all of the request was read.
    void refuse(Response response);

    Service& service_;
    std::string remote_;
    std::function<void()> wake_;
    ConnectionLimits limits_;
    RequestReader reader_;
    State state_ = State::head;
    Moment moment_;  // of the event in hand
    Plan plan_;
    std::string body_;
    std::deque<Output> outputs_;
    bool piece_with_disk_ = false;
    bool peer_done_ = false;
    bool advancing_ = false;
    Instant state_since_{};
    Instant input_at_{};
    Instant reported_at_{};
    std::uint64_t body_bytes_ = 0;
};

}  // namespace qduino::web
