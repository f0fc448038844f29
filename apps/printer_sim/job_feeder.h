// The service's side of a link, without a service: frames of one job, as many as the ring takes.
#pragma once

#include <array>
#include <cstdint>
#include <istream>
#include <optional>

#include "printer/link/frame.h"

namespace qduino::apps {

class JobFeeder {
  public:
    /// `input` holds `length` bytes from its present place on.
    JobFeeder(std::istream& input, std::uint64_t job_id, std::uint64_t length)
        : input_(input), job_id_(job_id), length_(length) {}

    /// Call now and then until everything has gone out; more calls do nothing.
    void feed(printer::link::LinkLayout& to) {
        namespace link = printer::link;
        if (!begun_) begun_ = link::try_push(to.jobs, link::encode(link::JobBegin{job_id_, length_}));
        while (begun_ && sent_ < length_) {
            if (!frame_ && !make_frame()) return;
            if (!link::try_push(to.jobs, *frame_)) return;
            sent_ += held_;
            frame_.reset();
        }
        if (begun_ && !ended_) ended_ = link::try_push(to.jobs, link::encode(link::JobEnd{job_id_}));
    }

  private:
    /// Once for each piece: its check sum is dear, and the ring is full most of the time.
    bool make_frame() {
        std::array<std::uint8_t, printer::link::kMaxJobBytes> bytes;
        input_.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
        held_ = static_cast<std::size_t>(input_.gcount());
        if (held_ == 0) return false;
        frame_ =
            printer::link::encode(printer::link::JobBytes{job_id_, sent_, std::span{bytes}.first(held_)});
        return true;
    }

    std::istream& input_;
    std::uint64_t job_id_;
    std::uint64_t length_;
    std::uint64_t sent_ = 0;
    std::optional<printer::link::Frame> frame_;  // not pushed yet
    std::size_t held_ = 0;                       // bytes of the job in it
    bool begun_ = false;
    bool ended_ = false;
};

}  // namespace qduino::apps
