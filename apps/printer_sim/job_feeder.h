// The service's side of a link, without a service: frames of one job, as many as the ring takes.
#pragma once

#include <array>
#include <cstdint>
#include <istream>

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
            if (held_ == 0) {
                input_.read(reinterpret_cast<char*>(buffer_.data()),
                            static_cast<std::streamsize>(buffer_.size()));
                held_ = static_cast<std::size_t>(input_.gcount());
                if (held_ == 0) return;
            }
            const link::JobBytes bytes{job_id_, sent_, std::span{buffer_}.first(held_)};
            if (!link::try_push(to.jobs, link::encode(bytes))) return;
            sent_ += held_;
            held_ = 0;
        }
        if (begun_ && !ended_) ended_ = link::try_push(to.jobs, link::encode(link::JobEnd{job_id_}));
    }

  private:
    std::istream& input_;
    std::uint64_t job_id_;
    std::uint64_t length_;
    std::uint64_t sent_ = 0;
    std::array<std::uint8_t, printer::link::kMaxJobBytes> buffer_{};
    std::size_t held_ = 0;
    bool begun_ = false;
    bool ended_ = false;
};

}  // namespace qduino::apps
