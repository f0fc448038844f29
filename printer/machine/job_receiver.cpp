#include "printer/machine/job_receiver.h"

#include <algorithm>

namespace qduino::printer::machine {

JobReceiver::Event JobReceiver::receive(Ring& ring, int frames_max) {
    if (held_begin_ < held_end_) return Event::bytes;
    for (int i = 0; i < frames_max; ++i) {
        const Result<std::optional<link::FrameView>> frame = reader_.read(ring);
        if (!frame.ok()) {
            ++refused_;
            continue;
        }
        if (!frame->has_value()) return Event::none;
        const Event event = take(**frame);
        if (event != Event::none) return event;
    }
    return Event::none;
}

JobReceiver::Event JobReceiver::take(const link::FrameView& frame) {
    if (frame.type == link::FrameType::job_begin) return take_begin(frame.payload);
    if (frame.type == link::FrameType::job_bytes) return take_bytes(frame.payload);
    if (frame.type == link::FrameType::job_end) return take_end(frame.payload);
    return refuse();
}

JobReceiver::Event JobReceiver::take_begin(std::span<const std::uint8_t> payload) {
    const Result<link::JobBegin> begin = link::decode_job_begin(payload);
    if (!begin.ok() || (running_ && begin->job_id > job_id_)) return refuse();
    if (begin->job_id <= job_id_) return Event::none;  // a repetition
    running_ = true;
    ended_ = false;
    job_id_ = begin->job_id;
    length_ = begin->length;
    estimated_s_ = begin->estimated_s;
    accepted_ = 0;
    held_begin_ = held_end_ = 0;
    return Event::begun;
}

JobReceiver::Event JobReceiver::take_bytes(std::span<const std::uint8_t> payload) {
    const Result<link::JobBytes> bytes = link::decode_job_bytes(payload);
    if (!bytes.ok()) return refuse();
    if (!running_ || bytes->job_id != job_id_) return Event::none;
    const std::uint64_t count = bytes->bytes.size();
    if (bytes->offset > length_ || count > length_ - bytes->offset) return refuse();
    if (bytes->offset > accepted_ || bytes->offset + count <= accepted_) return Event::none;
    const auto fresh = bytes->bytes.subspan(static_cast<std::size_t>(accepted_ - bytes->offset));
    std::copy(fresh.begin(), fresh.end(), buffer_.begin());
    held_begin_ = 0;
    held_end_ = fresh.size();
    accepted_ += fresh.size();
    return Event::bytes;
}

JobReceiver::Event JobReceiver::take_end(std::span<const std::uint8_t> payload) {
    const Result<link::JobEnd> end = link::decode_job_end(payload);
    if (!end.ok()) return refuse();
    if (!running_ || ended_ || end->job_id != job_id_ || accepted_ != length_) return Event::none;
    ended_ = true;
    return Event::ended;
}

}  // namespace qduino::printer::machine
