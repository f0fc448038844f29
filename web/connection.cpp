#include "web/connection.h"

namespace qduino::web {

namespace {

constexpr Nanoseconds kReportEvery = std::chrono::milliseconds{200};

}  // namespace

Connection::Connection(Service& service, std::string remote, std::function<void()> wake, Moment moment,
                       ConnectionLimits limits)
    : service_(service),
      remote_(std::move(remote)),
      wake_(std::move(wake)),
      limits_(limits),
      reader_(limits.read),
      moment_(moment),
      state_since_(moment.now),
      input_at_(moment.now) {}

bool Connection::wants_input() const {
    if (peer_done_) return false;
    switch (state_) {
        case State::head:
        case State::collecting:
        case State::draining:
            return true;
        case State::uploading:
            return !piece_with_disk_;
        case State::replying:
        case State::live:
        case State::closed:
            return false;
    }
    return false;
}

void Connection::receive(std::span<const char> bytes, Moment moment) {
    moment_ = moment;
    if (state_ == State::draining) return;  // thrown away
    if (state_ == State::head && reader_.idle()) state_since_ = moment.now;
    input_at_ = moment.now;
    reader_.feed(bytes);
    advance();
}

void Connection::receive_end() {
    peer_done_ = true;
    // Whoever has sent a whole request may close its side and still wait for the answer.
    if (state_ == State::replying || (state_ == State::uploading && piece_with_disk_)) return;
    close_cut_short();
}

/// The peer is done and its request is not whole. It may still be reading.
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
    const Nanoseconds in_state = moment.now - state_since_;
    const auto too_slow = [&] {
        const double allowed = limits_.body_rate_min * to_seconds(in_state);
        return moment.now - input_at_ > limits_.body_gap ||
               (in_state > limits_.body_grace && static_cast<double>(body_bytes_) < allowed);
    };
    switch (state_) {
        case State::head:
            if (reader_.idle()) {
                if (moment.now - input_at_ > limits_.idle_time) state_ = State::closed;
            } else if (in_state > limits_.head_time) {
                refuse(error_response(408, "timed_out", "the request's head took too long"));
            }
            return;
        case State::collecting:
        case State::uploading:
            if (!piece_with_disk_ && too_slow())
                refuse(error_response(408, "timed_out", "the body came too slowly"));
            return;
        case State::draining:
            if (in_state > limits_.drain_time) state_ = State::closed;
            return;
        case State::replying:
        case State::live:
        case State::closed:
            return;
    }
}

std::optional<Connection::Output> Connection::take_output() {
    if (outputs_.empty()) return std::nullopt;
    Output output = std::move(outputs_.front());
    outputs_.pop_front();
    return output;
}

void Connection::advance() {
    if (advancing_) return;  // an answer that came at once, from within a step: the loop below goes on
    advancing_ = true;
    while (step()) {
    }
    advancing_ = false;
}

/// One step of the reader; false when there is nothing to do until something happens.
bool Connection::step() {
    const bool reads = state_ == State::head || state_ == State::collecting ||
                       (state_ == State::uploading && !piece_with_disk_);
    if (!reads) return false;
    std::string bytes;
    const Result<RequestReader::Progress> progress = reader_.advance(bytes);
    if (!progress.ok()) {
        const bool large = progress.error().code == ErrorCode::out_of_range;
        refuse(error_response(large ? 431 : 400, "invalid_argument", progress.error().message.view()));
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
    body_bytes_ = 0;
    state_since_ = moment_.now;
    plan_ = service_.plan(head, remote_, moment_);
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
        outputs_.push_back({"HTTP/1.1 100 Continue\r\n\r\n", std::nullopt});
}

void Connection::on_body(std::string bytes) {
    body_bytes_ += bytes.size();
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
    if (upload) {
        service_.report_upload(*plan_.upload, plan_.upload->received());
        return service_.end_upload(std::move(plan_.upload), std::string{reader_.head().value("Host")},
                                   moment_, reply_later());
    }
    auto request = std::make_shared<Request>();
    request->head = reader_.head();
    request->body = std::move(body_);
    request->remote = remote_;
    service_.handle(std::move(request), moment_, reply_later());
}

void Connection::send_piece(std::string bytes) {
    piece_with_disk_ = true;
    service_.take_piece(plan_.upload, std::move(bytes), [self = shared_from_this()](Result<void> taken) {
        self->piece_with_disk_ = false;
        self->piece_done(taken);
        self->wake_();
    });
}

void Connection::piece_done(const Result<void>& taken) {
    if (state_ != State::uploading) return;  // dropped meanwhile
    input_at_ = moment_.now;
    if (!taken.ok()) return refuse(Service::refused_upload(taken.error()));
    report_progress();
    advance();
    if (peer_done_ && state_ == State::uploading && !piece_with_disk_) close_cut_short();
}

void Connection::report_progress() {
    if (moment_.now - reported_at_ < kReportEvery) return;
    reported_at_ = moment_.now;
    service_.report_upload(*plan_.upload, reader_.head().content_length.value_or(0));
}

Reply Connection::reply_later() {
    return [self = shared_from_this()](Response response) {
        if (self->state_ != State::replying) return;
        self->answer(std::move(response));
        self->advance();  // the next request may have arrived with this one
        self->wake_();
    };
}

void Connection::answer(Response response) {
    const RequestHead& head = reader_.head();
    const bool keep_alive = head.keep_alive && !response.close && !peer_done_;
    service_.metrics().count_request(response.status);
    Output output{head_bytes(response, keep_alive), std::nullopt};
    if (head.method != Method::head) {
        output.bytes += response.body;
        output.file = std::move(response.file);
    }
    outputs_.push_back(std::move(output));
    state_since_ = moment_.now;
    input_at_ = moment_.now;
    state_ = keep_alive ? State::head : State::closed;
    if (keep_alive) reader_.next();
}

void Connection::refuse(Response response) {
    service_.metrics().count_request(response.status);
    Output output{head_bytes(response, false), std::nullopt};
    if (reader_.head().method != Method::head) output.bytes += response.body;
    outputs_.push_back(std::move(output));
    drop_upload();
    state_since_ = moment_.now;
    // Closing at once would reset the connection under a peer that still sends, and with it the answer.
    state_ = peer_done_ ? State::closed : State::draining;
}

}  // namespace qduino::web
