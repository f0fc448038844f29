// The words of an enumeration, for reports and wires: a table in the order of its values, checked
// by the compiler.
#pragma once

#include <array>
#include <cstddef>
#include <string_view>

namespace qduino {

/// `kLast` is the last enumerator; values count up from `kFirst`. One word for each: another number
/// does not compile.
template <auto kFirst, decltype(kFirst) kLast>
class Words {
  public:
    using Enum = decltype(kFirst);
    static constexpr std::size_t kCount =
        static_cast<std::size_t>(kLast) - static_cast<std::size_t>(kFirst) + 1;

    template <typename... Texts>
    requires(sizeof...(Texts) == kCount) constexpr explicit Words(Texts... words) : words_{words...} {}

    /// The word of `value`; that of the last enumerator for a value that is none (a damaged page).
    [[nodiscard]] constexpr std::string_view operator()(Enum value) const {
        const std::size_t at = static_cast<std::size_t>(value) - static_cast<std::size_t>(kFirst);
        return words_[at < kCount ? at : kCount - 1];
    }

  private:
    std::array<std::string_view, kCount> words_;
};

}  // namespace qduino
