// The feeder: a run's bytes come from its file (link_feed.h has the protocol).
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "posix/unique_fd.h"
#include "spool/link_feed.h"

namespace qduino::spool {

class Feeder final : public LinkFeed {
  public:
    /// `file` holds `length` bytes. `estimated_s`: what the copy takes, 0 when nobody knows.
    Feeder(posix::UniqueFd file, std::uint64_t run_id, std::uint64_t length, double estimated_s = 0)
        : LinkFeed(run_id, length, estimated_s), file_(std::move(file)) {}
    /// Opens the file. Errors: not_found, corrupt (its size is not `length`).
    [[nodiscard]] static Result<Feeder> open(const std::filesystem::path& path, std::uint64_t run_id,
                                             std::uint64_t length, double estimated_s = 0);

  private:
    [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset, std::span<std::uint8_t> bytes) override;

    posix::UniqueFd file_;
};

}  // namespace qduino::spool
