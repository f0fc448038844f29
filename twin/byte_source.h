// The source of an asked path: bytes, a piece at a time, so that a 150 MB job is never held in
// memory.
#pragma once

#include <cstddef>
#include <fstream>
#include <span>
#include <string>

namespace qduino::twin {

class ByteSource {
  public:
    virtual ~ByteSource() = default;
    /// Fills up to `into.size()` bytes and returns how many; 0 at the end, and ever after.
    virtual std::size_t read(std::span<char> into) = 0;
};

/// A file. An unreadable one is empty: ask ok() first.
class FileSource final : public ByteSource {
  public:
    explicit FileSource(const std::string& path) : file_(path, std::ios::binary) {}
    [[nodiscard]] bool ok() const { return file_.is_open(); }
    std::size_t read(std::span<char> into) override {
        file_.read(into.data(), static_cast<std::streamsize>(into.size()));
        return static_cast<std::size_t>(file_.gcount());
    }

  private:
    std::ifstream file_;
};

}  // namespace qduino::twin
