// Making, opening and mapping the file of virtual pins (pins_layout.h), with all checks in one place.
#pragma once

#include <sys/mman.h>

#include <cstddef>
#include <string>
#include <utility>

#include "base/result.h"
#include "board/linux/pins_layout.h"
#include "board/linux/unique_fd.h"

namespace qduino::board::linux {

/// A shared mapping of a part of a file; unmapped when it goes.
class Mapping {
  public:
    Mapping() = default;
    Mapping(void* address, std::size_t bytes) : address_(address), bytes_(bytes) {}
    Mapping(Mapping&& other) noexcept
        : address_(std::exchange(other.address_, nullptr)), bytes_(std::exchange(other.bytes_, 0)) {}
    Mapping& operator=(Mapping&& other) noexcept {
        if (this != &other) {
            reset();
            address_ = std::exchange(other.address_, nullptr);
            bytes_ = std::exchange(other.bytes_, 0);
        }
        return *this;
    }
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    ~Mapping() { reset(); }

    [[nodiscard]] bool valid() const { return address_ != nullptr; }
    template <typename T>
    [[nodiscard]] T* as() const {
        return static_cast<T*>(address_);
    }

  private:
    void reset() {
        if (address_) ::munmap(address_, bytes_);
        address_ = nullptr;
    }
    void* address_ = nullptr;
    std::size_t bytes_ = 0;
};

/// Maps `bytes` of `fd` at `offset`, readable and writable; pages are faulted in at once when `populate` is
/// set.
Result<Mapping> map_shared(int fd, std::size_t offset, std::size_t bytes, bool populate);

/// Who holds the file, one of each kind at a time.
enum class PinsRole : int { machine = 0, sketch = 1, supervisor = 2 };

/// The opened file: descriptor (which carries the role's lock) and the mapped head.
class PinsFile {
  public:
    PinsFile() = default;  ///< none; only for assignment

    /// Makes a fresh file and renames it over `path`. For the machine. Error: unavailable when another
    /// machine lives on `path`; or the system's.
    static Result<PinsFile> create(const std::string& path);
    /// Opens an existing file in a role. Error: not_found (no machine has made it), corrupt (not such a
    /// file), unsupported (another version), unavailable (the role is taken by a living process).
    static Result<PinsFile> open(const std::string& path, PinsRole role);

    [[nodiscard]] bool valid() const { return head_.valid(); }
    [[nodiscard]] PinsLayout& layout() const { return *head_.as<PinsLayout>(); }
    /// Maps one writer's ring. Contract: 0 <= writer < kWriterCount.
    [[nodiscard]] Result<Mapping> map_ring(int writer, bool populate) const;

  private:
    UniqueFd fd_;
    Mapping head_;
};

}  // namespace qduino::board::linux
