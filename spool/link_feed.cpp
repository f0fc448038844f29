#include "spool/link_feed.h"

#include <algorithm>
#include <array>

#include "printer/link/frame.h"

namespace qduino::spool {

using printer::link::LinkLayout;

LinkFeed::LinkFeed(std::uint64_t run_id, std::uint64_t length, double estimated_s)
    : run_id_(run_id),
      length_(length),
      estimated_s_(static_cast<std::uint64_t>(std::clamp(estimated_s, 0.0, 1e12))) {}

Result<void> LinkFeed::begin(LinkLayout& link, Instant now) {
    const bool repeat = begin_sent_ && link.jobs.empty() && now - progress_at_ >= kRepeatAfter;
    if (!begin_sent_ || repeat) {
        const printer::link::JobBegin job{run_id_, length_, estimated_s_};
        if (!try_push(link.jobs, printer::link::encode(job))) return {};
        begin_sent_ = true;
        end_sent_ = false;
        sent_ = 0;
        progress_at_ = now;
    }
    return push_bytes(link);
}

Result<void> LinkFeed::feed(LinkLayout& link, std::uint64_t accepted, Instant now) {
    if (accepted != accepted_) progress_at_ = now;
    accepted_ = accepted;
    if (!feeding_ && !begin_sent_) {  // taken over from a feeder that died
        sent_ = accepted;
        progress_at_ = now;
    }
    feeding_ = true;
    sent_ = std::max(sent_, accepted);
    if (accepted < sent_ && link.jobs.empty() && now - progress_at_ >= kRepeatAfter) {
        sent_ = accepted;
        progress_at_ = now;
    }
    const Result<void> pushed = push_bytes(link);
    if (pushed.ok() && accepted == length_) push_end(link, now);
    return pushed;
}

Result<void> LinkFeed::feed_alone(LinkLayout& link, Instant now) {
    const printer::link::JobStatus status = link.job_status.read();
    return status.job_id == run_id_ ? feed(link, status.bytes_accepted, now) : begin(link, now);
}

Result<void> LinkFeed::push_bytes(LinkLayout& link) {
    std::array<std::uint8_t, printer::link::kMaxJobBytes> buffer;
    while (sent_ < length_) {
        const std::size_t count =
            static_cast<std::size_t>(std::min<std::uint64_t>(buffer.size(), length_ - sent_));
        if (link.jobs.free() < printer::link::kFrameMaxBytes) return {};
        QDUINO_TRY_ASSIGN(const std::size_t read, read_at(sent_, std::span{buffer}.first(count)));
        const std::span<const std::uint8_t> bytes = std::span{buffer}.first(read);
        if (!try_push(link.jobs, printer::link::encode(printer::link::JobBytes{run_id_, sent_, bytes})))
            return {};
        sent_ += read;
    }
    return {};
}

/// Only after the last byte is acknowledged: a job_end that overtakes a dropped frame would be
/// dropped itself.
void LinkFeed::push_end(LinkLayout& link, Instant now) {
    if (end_sent_ && !(link.jobs.empty() && now - progress_at_ >= kRepeatAfter)) return;
    if (!try_push(link.jobs, printer::link::encode(printer::link::JobEnd{run_id_}))) return;
    end_sent_ = true;
    progress_at_ = now;
}

}  // namespace qduino::spool
