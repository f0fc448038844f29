// The feeder: a run's bytes come from a file, or from memory (link_feed.h has the protocol).
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "base/bytes.h"
#include "spool/link_feed.h"

namespace qduino::spool {

class Feeder final : public LinkFeed {
  public:
    /// All of `bytes` are the run's. `estimated_s`: what the copy takes, 0 when nobody knows.
    Feeder(std::shared_ptr<const ByteSource> bytes, std::uint64_t run_id, double estimated_s = 0)
        : LinkFeed(run_id, bytes->size(), estimated_s), bytes_(std::move(bytes)) {}

  private:
    [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) override {
        const Result<std::size_t> read =
            bytes_->read_at(offset, {reinterpret_cast<char*>(bytes.data()), bytes.size()});
        if (!read || *read == 0)
            return make_error(ErrorCode::corrupt, "the job's file cannot be read to its end");
        return read;
    }

    std::shared_ptr<const ByteSource> bytes_;
};

}  // namespace qduino::spool
