// The bytes of a file, to be read from any place, or appended.
#pragma once

#include <filesystem>
#include <memory>

#include "base/bytes.h"
#include "posix/unique_fd.h"

namespace qduino::posix {

class FileBytes final : public ByteSource {
  public:
    /// Reads only. An invalid `file` has no bytes.
    explicit FileBytes(UniqueFd file);
    /// Null when there is no such file, or it cannot be opened. Follows no link.
    [[nodiscard]] static std::shared_ptr<const FileBytes> open(const std::filesystem::path& path);

    [[nodiscard]] std::uint64_t size() const override { return size_; }
    [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset, std::span<char> bytes) const override;

  private:
    UniqueFd file_;
    std::uint64_t size_ = 0;
};

/// Made when its first bytes come; what was there before is gone then.
class FileSink final : public ByteSink {
  public:
    explicit FileSink(std::filesystem::path path) : path_(std::move(path)) {}
    [[nodiscard]] Result<void> write(std::span<const char> bytes) override;

  private:
    std::filesystem::path path_;
    UniqueFd file_;
};

}  // namespace qduino::posix
