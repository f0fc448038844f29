// A vector of bounded length, without a heap.
#pragma once

#include <array>
#include <cstddef>

#include "base/contract.h"

namespace qduino {

/// Up to N values of a default-constructible T, stored in place.
template <typename T, std::size_t N>
class FixedVector {
  public:
    using value_type = T;
    static constexpr std::size_t kCapacity = N;

    constexpr FixedVector() = default;

    [[nodiscard]] constexpr std::size_t size() const { return size_; }
    [[nodiscard]] constexpr bool empty() const { return size_ == 0; }
    [[nodiscard]] constexpr bool full() const { return size_ == N; }
    constexpr void clear() { size_ = 0; }

    /// False, and nothing changed, when full.
    [[nodiscard]] constexpr bool try_push_back(const T& value) {
        if (full()) return false;
        items_[size_++] = value;
        return true;
    }
    /// Contract: not full.
    constexpr void push_back(const T& value) {
        QDUINO_EXPECT(!full());
        items_[size_++] = value;
    }
    /// Inserts before index `at`. Contract: not full, at <= size().
    constexpr void insert(std::size_t at, const T& value) {
        QDUINO_EXPECT(!full() && at <= size_);
        for (std::size_t i = size_; i > at; --i) items_[i] = items_[i - 1];
        items_[at] = value;
        ++size_;
    }
    /// Removes the item at index `at`, keeping order. Contract: at < size().
    constexpr void erase(std::size_t at) {
        QDUINO_EXPECT(at < size_);
        for (std::size_t i = at + 1; i < size_; ++i) items_[i - 1] = items_[i];
        --size_;
    }
    constexpr void pop_back() {
        QDUINO_EXPECT(size_ > 0);
        --size_;
    }

    constexpr T& operator[](std::size_t i) { return items_[checked(i)]; }
    constexpr const T& operator[](std::size_t i) const { return items_[checked(i)]; }
    constexpr T& front() { return (*this)[0]; }
    constexpr const T& front() const { return (*this)[0]; }
    constexpr T& back() { return (*this)[size_ - 1]; }
    constexpr const T& back() const { return (*this)[size_ - 1]; }
    constexpr T* begin() { return items_.data(); }
    constexpr T* end() { return items_.data() + size_; }
    constexpr const T* begin() const { return items_.data(); }
    constexpr const T* end() const { return items_.data() + size_; }

  private:
    [[nodiscard]] constexpr std::size_t checked(std::size_t i) const {
        QDUINO_EXPECT(i < size_);
        return i;
    }

    std::array<T, N> items_{};
    std::size_t size_ = 0;
};

}  // namespace qduino
