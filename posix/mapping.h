// Memory that processes share: a part of a file, or pages that children inherit. Unmapped when it
// is destroyed.
#pragma once

#include <cstddef>
#include <utility>

#include "base/result.h"

namespace qduino::posix {

/// Owns one shared mapping, or none. Moves, never copies.
class Mapping {
  public:
    Mapping() = default;
    Mapping(Mapping&& other) noexcept
        : address_(std::exchange(other.address_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Mapping& operator=(Mapping&& other) noexcept {
        std::swap(address_, other.address_);
        std::swap(bytes_, other.bytes_);
        return *this;
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    ~Mapping();

    [[nodiscard]] bool valid() const { return address_ != nullptr; }
    template <typename T>
    [[nodiscard]] T* as() const {
        return static_cast<T*>(address_);
    }

  private:
    friend Result<Mapping> map_shared(int, std::size_t, std::size_t, bool);
    friend Result<Mapping> map_anonymous(std::size_t);
    friend Result<Mapping> map_read_only(int, std::size_t);
    Mapping(void* address, std::size_t bytes) : address_(address), bytes_(bytes) {}

    void* address_ = nullptr;
    std::size_t bytes_ = 0;
};

/// Maps `bytes` of `fd` at `offset` (whole pages), readable and writable. `populate` faults the
/// pages in at once.
[[nodiscard]] Result<Mapping> map_shared(int fd, std::size_t offset, std::size_t bytes, bool populate);

/// Maps the first `bytes` of `fd`, to be read alone.
[[nodiscard]] Result<Mapping> map_read_only(int fd, std::size_t bytes);

/// `bytes` of zeros that children made by fork() share. The pages are there at once.
[[nodiscard]] Result<Mapping> map_anonymous(std::size_t bytes);

}  // namespace qduino::posix
