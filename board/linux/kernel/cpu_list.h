// A set of CPUs, in the two notations of the kernel: as a list "0-3,6" and as a hexadecimal mask in
// groups of 32 bits "00000001,0000004f".
#pragma once

#include <bitset>
#include <optional>
#include <string>
#include <string_view>

namespace qduino::board::linux {

class CpuList {
  public:
    static constexpr int kLimit = 1024;

    CpuList() = default;
    /// CPUs 0 … count−1.
    static CpuList first(int count);
    /// Trailing white space is ignored, and an empty text is the empty set. Nothing when `text` is
    /// not a list.
    static std::optional<CpuList> from_list(std::string_view text);
    static std::optional<CpuList> from_mask(std::string_view text);

    [[nodiscard]] std::string to_list() const;
    /// Has as many groups as CPUs 0 … `cpus`−1 need.
    [[nodiscard]] std::string to_mask(int cpus) const;

    void add(int cpu) { bits_.set(static_cast<std::size_t>(cpu)); }
    void remove(int cpu) { bits_.reset(static_cast<std::size_t>(cpu)); }
    [[nodiscard]] bool has(int cpu) const {
        return cpu >= 0 && cpu < kLimit && bits_.test(static_cast<std::size_t>(cpu));
    }
    [[nodiscard]] bool empty() const { return bits_.none(); }
    [[nodiscard]] int size() const { return static_cast<int>(bits_.count()); }
    [[nodiscard]] CpuList without(const CpuList& others) const;
    bool operator==(const CpuList&) const = default;

  private:
    std::bitset<kLimit> bits_;
};

}  // namespace qduino::board::linux
