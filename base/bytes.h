// Bytes that lie in a file or in memory: who reads or writes them need not know which.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>

#include "base/result.h"

namespace qduino {

/// Bytes that do not change. Any thread.
class ByteSource {
  public:
    virtual ~ByteSource() = default;
    [[nodiscard]] virtual std::uint64_t size() const = 0;
    /// Reads into `bytes` from `offset` on: all that fit, or as many as there are. 0: there are
    /// none there. Error: corrupt, they cannot be read.
    [[nodiscard]] virtual Result<std::size_t> read_at(std::uint64_t offset, std::span<char> bytes) const = 0;
};

class ByteSink {
  public:
    virtual ~ByteSink() = default;
    /// Appends. Errors: out_of_range (so much is never taken), unavailable (there is no room now).
    [[nodiscard]] virtual Result<void> write(std::span<const char> bytes) = 0;
};

class BytesInMemory final : public ByteSource {
  public:
    explicit BytesInMemory(std::shared_ptr<const std::string> bytes) : bytes_(std::move(bytes)) {}
    [[nodiscard]] std::uint64_t size() const override { return bytes_->size(); }
    [[nodiscard]] Result<std::size_t> read_at(std::uint64_t offset, std::span<char> bytes) const override {
        if (offset >= bytes_->size()) return std::size_t{0};
        return bytes_->copy(bytes.data(), bytes.size(), offset);
    }

  private:
    std::shared_ptr<const std::string> bytes_;
};

/// All of them. For small ones. Error: as read_at(), and corrupt, when they end before their size.
[[nodiscard]] inline Result<std::string> read_whole(const ByteSource& source) {
    std::string bytes(source.size(), '\0');
    for (std::size_t done = 0; done < bytes.size();) {
        QDUINO_TRY_ASSIGN(const std::size_t count, source.read_at(done, std::span{bytes}.subspan(done)));
        if (count == 0) return make_error(ErrorCode::corrupt, "the bytes end too early");
        done += count;
    }
    return bytes;
}

}  // namespace qduino
