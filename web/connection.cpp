#include "web/connection.h"

namespace qduino::web {

namespace {

constexpr Nanoseconds kReportEvery = std::chrono::milliseconds{200};

}  // namespace

void Pace::moved(std::uint64_t count, Instant now) {
    bytes += count;
    if (count > 0) last = now;
}

bool Pace::is_too_slow(Instant now, Nanoseconds gap, const ConnectionLimits& limits) const {
    const Nanoseconds passed = now - began;
    return now - last > gap || (passed > limits.body_grace &&
                                static_cast<double>(bytes) < limits.body_rate_min * to_seconds(passed));
}

Connection::Connection(Service& service, Peer peer, std::function<void()> wake, Moment moment,
                       ConnectionLimits limits)
    : service_(service),
      peer_(std::move(peer)),
      wake_(std::move(wake)),
      limits_(limits),
      reader_(limits.read),
      moment_(moment),
      since_{moment.now, moment.now, {}} {}

bool Connection::wants_input() const {
    if (peer_done_) return false;
    return state_ == State::head || state_ == State::collecting || state_ == State::draining ||
           (state_ == State::uploading && !piece_with_disk_);
}

std::size_t Connection::input_max() const {
    if (!wants_input()) return 0;
    return state_ == State::uploading || state_ == State::draining ? kBodyReadMax : kHeadReadMax;
}

std::size_t Connection::held_bytes() const {
    std::size_t total = reader_.held_bytes() + body_.size();
    for (const Output& output : outputs_) total += output.held_bytes();
    return total;
}

std::string Connection::take_rest() {
    QDUINO_EXPECT(is_live());
    return reader_.take_rest();
}

void Connection::receive(std::span<const char> bytes, Moment moment) {
    moment_ = moment;
    if (state_ == State::head && reader_.idle()) since_.state = moment.now;
    since_.input = moment.now;
    if (state_ == State::draining) return;  // thrown away
    body_pace_.moved(bytes.size(), moment.now);
    reader_.feed(bytes);
    advance();
}

void Connection::receive_end() {
    peer_done_ = true;
    // A peer that has sent a whole request may close its side and still wait for the answer.
    if (state_ == State::replying || state_ == State::answering) return;
    if (state_ == State::uploading && piece_with_disk_) return;
    close_cut_short();
}

/// The peer has sent its last byte and its request is not whole. It may still be reading.
void Connection::close_cut_short() {
    const bool in_body = state_ == State::collecting || state_ == State::uploading;
    if (in_body)
        refuse(error_response(400, "invalid_argument", "the body ended before its length; nothing was kept"));
    state_ = State::closed;
    drop_upload();
}

/// Contract: no piece of it is with the disk.
void Connection::drop_upload() {
    if (plan_.upload) plan_.upload->discard();
    plan_.upload.reset();
}

void Connection::check_time(Moment moment) {
    moment_ = moment;
    const Nanoseconds in_state = moment.now - since_.state;
    if (sending_ && send_pace_.is_too_slow(moment.now, limits_.send_gap, limits_)) stalled_ = true;
    switch (state_) {
        case State::head:
            if (reader_.idle()) {
                if (moment.now - since_.input > limits_.idle_time) state_ = State::closed;
            } else if (in_state > limits_.head_time) {
                refuse(error_response(408, "timed_out", "the request's head took too long"));
            }
            return;
        case State::collecting:
        case State::uploading:
            return check_body_time(moment);
        case State::draining:
            if (in_state > (known_ ? limits_.drain_known_time : limits_.drain_time)) state_ = State::closed;
            if (in_state > limits_.drain_time && moment.now - since_.input > limits_.drain_time)
                state_ = State::closed;
            return;
        case State::replying:
        case State::answering:
        case State::live:
        case State::closed:
            return;
    }
}

/// A body without a proof is that of a login: small, and as urgent as a head.
void Connection::check_body_time(Moment moment) {
    if (piece_with_disk_) return;
    const bool login_late = !known_ && moment.now - since_.state > limits_.head_time;
    if (login_late || body_pace_.is_too_slow(moment.now, limits_.body_gap, limits_))
        refuse(error_response(408, "timed_out", "the body came too slowly"));
}

std::optional<Connection::Output> Connection::take_output() {
    if (outputs_.empty() || sending_) return std::nullopt;
    Output output = std::move(outputs_.front());
    outputs_.pop_front();
    sending_ = true;
    send_pace_.begin(moment_.now);
    return output;
}

void Connection::sent(Moment moment) {
    moment_ = moment;
    sending_ = false;
    if (state_ != State::answering || !outputs_.empty()) return;
    since_.state = moment.now;
    since_.input = moment.now;
    state_ = peer_done_ ? State::closed : State::head;
    if (peer_done_) return;
    reader_.next();
    advance();  // the next request may have arrived with this one
}

void Connection::advance() {
    // The answer came at once, from within a step: the loop below goes on.
    if (advancing_) return;
    advancing_ = true;
    while (step()) {
    }
    advancing_ = false;
}

/// One step of the reader; false when nothing is left to do for now.
bool Connection::step() {
    const bool reads = state_ == State::head || state_ == State::collecting ||
                       (state_ == State::uploading && !piece_with_disk_);
    if (!reads) return false;
    std::string bytes;
    const Result<RequestReader::Progress> progress = reader_.advance(bytes);
    if (!progress.ok()) {
        refuse(refused_request(progress.error()));
        return false;
    }
    switch (*progress) {
        case RequestReader::Progress::need_more:
            return false;
        case RequestReader::Progress::head:
            on_head();
            return true;
        case RequestReader::Progress::body:
            on_body(std::move(bytes));
            return true;
        case RequestReader::Progress::complete:
            on_complete();
            return true;
    }
    return false;
}

void Connection::on_head() {
    const RequestHead& head = reader_.head();
    body_.clear();
    body_pace_.begin(moment_.now);
    since_.state = moment_.now;
    client_ = service_.client_of(head, peer_);
    plan_ = service_.plan(head, client_, moment_);
    note_proof();
    switch (plan_.kind) {
        case Plan::Kind::respond:
            if (head.has_body()) return refuse(std::move(plan_.response));
            state_ = State::collecting;  // the reader says `complete` next
            return;
        case Plan::Kind::live:
            state_ = State::live;
            return;
        case Plan::Kind::collect:
            if (head.content_length.value_or(0) > plan_.body_max) {
                return refuse(error_response(413, "out_of_range", "the body is too long"));
            }
            state_ = State::collecting;
            break;
        case Plan::Kind::upload:
            state_ = State::uploading;
            break;
    }
    if (head.expects_continue && head.has_body())
        outputs_.push_back({"HTTP/1.1 100 Continue\r\n\r\n", {}, nullptr, std::nullopt});
}

/// A request that needs no proof (for the page's files) changes nothing.
void Connection::note_proof() {
    if (plan_.proof != Proof::none) known_ = true;
    const bool refused =
        plan_.kind == Plan::Kind::respond && (plan_.response.status == 401 || plan_.response.status == 429);
    if (refused) known_ = false;
}

void Connection::on_body(std::string bytes) {
    if (state_ == State::uploading) return send_piece(std::move(bytes));
    if (body_.size() + bytes.size() > plan_.body_max) {
        return refuse(error_response(413, "out_of_range", "the body is too long"));
    }
    body_ += bytes;
}

void Connection::on_complete() {
    if (plan_.kind == Plan::Kind::respond) return answer(std::move(plan_.response));
    const bool upload = state_ == State::uploading;
    state_ = State::replying;
    auto request = std::make_shared<Request>();
    request->head = reader_.head();
    request->body = std::move(body_);
    request->client = client_;
    if (upload) {
        service_.report_upload(*plan_.upload, plan_.upload->received());
        return service_.end_upload(std::move(plan_.upload), std::move(request), moment_, reply_later());
    }
    service_.handle(std::move(request), moment_, reply_later());
}

void Connection::send_piece(std::string bytes) {
    piece_with_disk_ = true;
    service_.take_piece(plan_.upload, std::move(bytes),
                        [self = shared_from_this()](std::optional<Response> refusal) {
                            self->piece_with_disk_ = false;
                            self->piece_done(std::move(refusal));
                            self->wake_();
                        });
}

void Connection::piece_done(std::optional<Response> refusal) {
    if (state_ != State::uploading) return;  // dropped meanwhile
    body_pace_.last = moment_.now;
    if (refusal) return refuse(std::move(*refusal));
    report_progress();
    advance();
    if (peer_done_ && state_ == State::uploading && !piece_with_disk_) close_cut_short();
}

void Connection::report_progress() {
    if (moment_.now - since_.reported < kReportEvery) return;
    since_.reported = moment_.now;
    service_.report_upload(*plan_.upload, reader_.head().content_length.value_or(0));
}

Reply Connection::reply_later() {
    return [self = shared_from_this()](Response response) {
        if (self->state_ != State::replying) return;
        self->answer(std::move(response));
        self->wake_();
    };
}

Connection::Output Connection::output_of(Response response, bool keep_alive) const {
    service_.metrics().count_request(response.status);
    Output output{head_bytes(response, keep_alive), {}, nullptr, std::nullopt};
    if (reader_.head().method == Method::head) return output;
    output.body = std::move(response.body);
    output.shared = std::move(response.shared);
    output.file = std::move(response.file);
    return output;
}

void Connection::answer(Response response) {
    const bool keep_alive = reader_.head().keep_alive && !response.close && !peer_done_;
    if (plan_.proves) known_ = response.status < 300;
    outputs_.push_back(output_of(std::move(response), keep_alive));
    since_.state = moment_.now;
    state_ = keep_alive ? State::answering : State::closed;
}

void Connection::refuse(Response response) {
    outputs_.push_back(output_of(std::move(response), false));
    drop_upload();
    since_.state = moment_.now;
    // To close at once would reset the connection under a peer that still sends, and lose the
    // answer.
    state_ = peer_done_ ? State::closed : State::draining;
}

}  // namespace qduino::web
