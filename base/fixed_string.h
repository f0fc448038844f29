// A string of bounded length, without a heap: for error texts and names that cross real-time loops
// and shared memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>

namespace qduino {

/// Up to N bytes of text; what does not fit is cut. Trivially copyable, so it may live in shared
/// memory.
template <std::size_t N>
class FixedString {
  public:
    static constexpr std::size_t kCapacity = N;

    constexpr FixedString() = default;
    constexpr FixedString(std::string_view text) { assign(text); }  // NOLINT: implicit, as std::string is
    constexpr FixedString(const char* text) { assign(text); }       // NOLINT

    constexpr void assign(std::string_view text) {
        size_ = 0;
        append(text);
    }
    constexpr FixedString& append(std::string_view text) {
        const std::size_t held = size();  // bounded, even if a damaged shared page says otherwise
        const std::size_t count = std::min(N - held, text.size());
        for (std::size_t i = 0; i < count; ++i) bytes_[held + i] = text[i];
        size_ = static_cast<std::uint32_t>(held + count);
        return *this;
    }
    constexpr FixedString& push_back(char c) { return append(std::string_view{&c, 1}); }
    constexpr void clear() { size_ = 0; }

    [[nodiscard]] constexpr std::string_view view() const {
        return {bytes_, std::min<std::size_t>(size_, N)};
    }
    constexpr operator std::string_view() const { return view(); }  // NOLINT: a view is always safe
    [[nodiscard]] constexpr std::size_t size() const { return std::min<std::size_t>(size_, N); }
    [[nodiscard]] constexpr bool empty() const { return size() == 0; }
    friend constexpr bool operator==(const FixedString& a, std::string_view b) { return a.view() == b; }

  private:
    std::uint32_t size_ = 0;
    char bytes_[N] = {};
};

}  // namespace qduino
