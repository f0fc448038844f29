// One HTTP/1.1 connection without its socket: bytes in, bytes out, and what it waits for.
//
//            ┌───────────────────────────── keep-alive ─────────────────────────────┐
//            ▼                                                                      │
//   head ──► plan ─┬─ respond ───────────────────────────────► answering ──► sent ──┤
//                  ├─ collect ──► body ──► handle ──► replying ──► answering ───────┘
//                  ├─ upload ───► piece ⇄ disk, judged ──► end ──► replying ──► answering …
//                  ├─ live ─────► the socket's owner takes over
//                  └─ refused with a body unread ──► (answer) ──► draining ──► closed
//
// A peer may send faster than the disk writes, or read slower than we answer. So there is back
// pressure: while a piece is with the disk, an answer is awaited, or one is not yet with the
// kernel, the connection takes no input and does not look at the next request. It then holds one
// read's worth of bytes and one answer, however long its upload and however many requests were sent
// at once. Every state has a deadline, in both directions: a peer that moves a byte a minute is
// dropped.
//
// I/O thread only. An answer that comes later keeps the connection alive until it has come (shared
// from this).
//
// It has more functions and members than other classes: one short function for each state above,
// and what a request in each state holds.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "web/http/request_reader.h"
#include "web/service.h"

namespace qduino::web {

struct ConnectionLimits {
    ReadLimits read;
    Nanoseconds handshake_time = std::chrono::seconds{10};  ///< TLS, from its turn on
    Nanoseconds head_time = std::chrono::seconds{15};       ///< a head, first byte to last
    Nanoseconds idle_time = std::chrono::seconds{75};       ///< between requests
    Nanoseconds body_gap = std::chrono::seconds{30};        ///< between two pieces of a body
    /// Within this time the peer has to take some of an answer.
    Nanoseconds send_gap = std::chrono::seconds{60};
    /// After this time a body, or an answer, has to move at …
    Nanoseconds body_grace = std::chrono::seconds{60};
    double body_rate_min = 1024;  ///< … this many bytes a second on average
    /// How long a refused body may still be sent; it is thrown away.
    Nanoseconds drain_time = std::chrono::seconds{5};
    /// The same for who has shown the key: some clients read the answer only when they have sent
    /// all of a large file. No pause in it is longer than drain_time.
    Nanoseconds drain_known_time = std::chrono::seconds{60};
};

/// The speed of the bytes in one direction.
struct Pace {
    Instant began{};
    Instant last{};
    std::uint64_t bytes = 0;

    void begin(Instant now) { *this = {now, now, 0}; }
    void moved(std::uint64_t count, Instant now);
    [[nodiscard]] bool is_too_slow(Instant now, Nanoseconds gap, const ConnectionLimits& limits) const;
};

class Connection : public std::enable_shared_from_this<Connection> {
  public:
    struct Output {
        std::string bytes;
        std::string body;                           ///< behind `bytes`
        std::shared_ptr<const std::string> shared;  ///< or this, which others have too
        std::optional<FileRange> file;              ///< or this
        /// Memory of its own, without what is shared.
        [[nodiscard]] std::size_t held_bytes() const { return bytes.size() + body.size(); }
    };
    static constexpr std::size_t kHeadReadMax = 16 * 1024;
    static constexpr std::size_t kBodyReadMax = 64 * 1024;

    /// `wake` is called when an answer has come: there may be something to do.
    Connection(Service& service, Peer peer, std::function<void()> wake, Moment moment,
               ConnectionLimits limits = {});

    /// Bytes from the peer. Only while wants_input().
    void receive(std::span<const char> bytes, Moment moment);
    /// The peer has sent its last byte.
    void receive_end();
    /// Time has passed: deadlines.
    void check_time(Moment moment);

    [[nodiscard]] bool wants_input() const;
    /// How many bytes to receive at once: more than a head only where they can be handed on.
    [[nodiscard]] std::size_t input_max() const;
    /// The next bytes to send, in order; nothing when there are none now. The output before must
    /// have been sent.
    [[nodiscard]] std::optional<Output> take_output();
    /// The kernel has taken some of the output in hand.
    void sent_some(std::size_t count, Moment moment) { send_pace_.moved(count, moment.now); }
    /// The output in hand is sent, its file too. Only now is the next request looked at.
    void sent(Moment moment);
    /// True when the peer takes nothing, or next to nothing, of what is sent to it: the connection
    /// can only be closed.
    [[nodiscard]] bool is_stalled() const { return stalled_; }
    /// No more output will come. Once all outputs are sent, shut the sending side.
    [[nodiscard]] bool wants_close() const { return state_ == State::draining || state_ == State::closed; }
    /// No more input is wanted, either.
    [[nodiscard]] bool is_closed() const { return state_ == State::closed; }
    /// A live stream was admitted: the connection belongs to the stream's owner now.
    [[nodiscard]] bool is_live() const { return state_ == State::live; }
    [[nodiscard]] const RequestHead& head() const { return reader_.head(); }
    /// What the client has sent behind that request already. Contract: is_live().
    [[nodiscard]] std::string take_rest();
    /// Between requests: may be dropped to make room.
    [[nodiscard]] bool is_idle() const { return state_ == State::head && reader_.idle(); }
    /// Its requests have proved a key, a session or a ticket, and the last one that tried did not
    /// fail.
    [[nodiscard]] bool is_known() const { return known_; }
    /// Memory for input and output that wait, without what is shared.
    [[nodiscard]] std::size_t held_bytes() const;

  private:
    enum class State : std::uint8_t {
        head,
        collecting,
        uploading,
        replying,
        answering,
        draining,
        live,
        closed
    };

    void advance();
    bool step();
    void on_head();
    void note_proof();
    void check_body_time(Moment moment);
    [[nodiscard]] Output output_of(Response response, bool keep_alive) const;
    void on_body(std::string bytes);
    void on_complete();
    void send_piece(std::string bytes);
    void piece_done(std::optional<Response> refusal);
    void report_progress();
    void close_cut_short();
    void drop_upload();
    [[nodiscard]] Reply reply_later();
    void answer(Response response);
    /// Answers although the request was not read to its end.
    void refuse(Response response);

    Service& service_;
    Peer peer_;
    Client client_;  // of the request in hand
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
    bool sending_ = false;  // an output was taken and is not yet sent
    bool stalled_ = false;
    bool known_ = false;
    struct {
        Instant state{};     // since when it is in its state
        Instant input{};     // when bytes came last
        Instant reported{};  // when an upload's progress was told last
    } since_;
    Pace body_pace_;
    Pace send_pace_;
};

}  // namespace qduino::web
