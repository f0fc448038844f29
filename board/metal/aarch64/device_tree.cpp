#include "board/metal/aarch64/device_tree.h"

#include <algorithm>

namespace qduino::board::metal {
namespace {

enum Token : std::uint32_t { kBeginNode = 1, kEndNode = 2, kProperty = 3, kNothing = 4 };

std::uint32_t word_at(std::uint64_t at) {
    const auto* const bytes = reinterpret_cast<const std::uint8_t*>(at);
    return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 | std::uint32_t{bytes[2]} << 8 |
           bytes[3];
}

/// The value of a property: numbers of 32 or 64 bits, or text.
class Value {
  public:
    Value() = default;
    Value(std::uint64_t at, std::uint32_t size) : at_(at), size_(size) {}
    [[nodiscard]] std::uint32_t word(std::uint32_t index) const {
        return 4 * index + 4 <= size_ ? word_at(at_ + 4 * index) : 0;
    }
    [[nodiscard]] std::uint64_t wide(std::uint32_t index) const {
        return std::uint64_t{word(index)} << 32 | word(index + 1);
    }
    /// The first of its strings.
    [[nodiscard]] std::string_view text() const { return all().substr(0, all().find('\0')); }
    /// `wanted` is among its strings.
    [[nodiscard]] bool has(std::string_view wanted) const {
        for (std::string_view rest = all(); !rest.empty();) {
            const std::string_view one = rest.substr(0, rest.find('\0'));
            if (one == wanted) return true;
            rest.remove_prefix(std::min(rest.size(), one.size() + 1));
        }
        return false;
    }

  private:
    [[nodiscard]] std::string_view all() const { return {reinterpret_cast<const char*>(at_), size_}; }

    std::uint64_t at_ = 0;
    std::uint32_t size_ = 0;
};

/// What of a node may matter here. Its properties come before the nodes in it.
struct Node {
    std::string_view name;
    Value registers, kind, interrupts, words, method;

    void take(std::string_view property, Value value) {
        if (property == "reg") registers = value;
        if (property == "compatible") kind = value;
        if (property == "interrupts") interrupts = value;
        if (property == "bootargs") words = value;
        if (property == "method") method = value;
    }
};

DevicePlace place_of(const Node& node) {
    return {.at = node.registers.wide(0), .line = static_cast<std::uint8_t>(node.interrupts.word(1))};
}

/// Addresses and sizes have two words each, and the number of a core has one: so virt has them.
void take(const Node& node, DeviceTree& tree) {
    if (node.name == "chosen") tree.words = node.words.text();
    if (node.name == "psci") tree.psci_by_smc = node.method.text() == "smc";
    if (node.name.starts_with("memory@") && tree.ram_end == 0) {
        tree.ram_begin = node.registers.wide(0);
        tree.ram_end = tree.ram_begin + node.registers.wide(2);
    }
    if (node.name.starts_with("cpu@") && tree.cores.size() < kCoresMax)
        tree.cores.push_back(node.registers.word(0));
    if (node.kind.has("arm,cortex-a15-gic") || node.kind.has("arm,gic-400")) {
        tree.gic_distributor = node.registers.wide(0);
        tree.gic_cpu = node.registers.wide(4);
    }
    if (node.kind.has("arm,pl011") && tree.uart.at == 0) tree.uart = place_of(node);
    if (node.kind.has("arm,pl061") && tree.gpio.at == 0) tree.gpio = place_of(node);
    if (node.kind.has("arm,pl031") && tree.clock.at == 0) tree.clock = place_of(node);
}

std::string_view text_at(std::uint64_t at) { return reinterpret_cast<const char*>(at); }
std::uint64_t rounded(std::uint64_t size) { return (size + 3) & ~std::uint64_t{3}; }

}  // namespace

bool read_device_tree(std::uint64_t at, DeviceTree& tree) {
    if (word_at(at) != kDeviceTreeMagic) return false;
    std::uint64_t next = at + word_at(at + 8);
    const std::uint64_t names = at + word_at(at + 12), end = next + word_at(at + 36);
    Node node;
    while (next < end) {
        const std::uint32_t token = word_at(next);
        next += 4;
        if (token == kBeginNode || token == kEndNode) {
            take(node, tree);
            node = {};
        }
        if (token == kBeginNode) {
            node.name = text_at(next);
            next += rounded(node.name.size() + 1);
        } else if (token == kProperty) {
            const std::uint32_t size = word_at(next);
            node.take(text_at(names + word_at(next + 4)), {next + 8, size});
            next += 8 + rounded(size);
        } else if (token != kEndNode && token != kNothing) {
            break;
        }
    }
    return true;
}

}  // namespace qduino::board::metal
