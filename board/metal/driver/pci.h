// PCI: which devices there are, and where the registers of one of them lie.
//
//   bus, device, function ─► 256 bytes of configuration, through ports 0xCF8 and 0xCFC
//                              ├─ identity          vendor and device
//                              ├─ base addresses    of its registers in memory
//                              └─ capabilities      a list of further parts
//
// PCI Local Bus Specification 3.0, 6.1 (configuration header), 6.7 (capabilities); 3.2.2.3.2 (the
// ports). The firmware has given the addresses.
#pragma once

#include <cstdint>
#include <optional>

namespace qduino::board::metal {

/// Registers of a device in memory, each of 8, 16 or 32 bits.
class Registers {
  public:
    constexpr Registers() = default;
    constexpr explicit Registers(std::uint64_t at) : at_(at) {}

    template <typename T>
    [[nodiscard]] T read(std::uint32_t offset) const {
        return *reinterpret_cast<volatile T*>(at_ + offset);
    }
    template <typename T>
    void write(std::uint32_t offset, T value) const {
        *reinterpret_cast<volatile T*>(at_ + offset) = value;
    }
    [[nodiscard]] bool exist() const { return at_ != 0; }
    /// Where what is there is memory: as an object; null: there is none.
    template <typename T>
    [[nodiscard]] T* memory() const {
        return reinterpret_cast<T*>(at_);
    }
    [[nodiscard]] Registers from(std::uint32_t offset) const { return Registers(at_ + offset); }

  private:
    std::uint64_t at_ = 0;
};

class PciDevice {
  public:
    /// The first device that has this identity, on any bus that is reached from the first.
    static std::optional<PciDevice> find(std::uint16_t vendor, std::uint16_t device);

    /// `offset` is a multiple of 4.
    [[nodiscard]] std::uint32_t read(std::uint8_t offset) const;
    void write(std::uint8_t offset, std::uint32_t value) const;

    /// It may be reached in memory, reach memory itself, and uses its interrupt line, or not.
    void enable(bool line) const;
    /// The ISA line that the firmware has led its interrupt line to.
    [[nodiscard]] std::uint8_t line() const { return static_cast<std::uint8_t>(read(0x3c)); }
    /// The registers behind base address `number`; none where there is none, or beyond 4 GiB, which
    /// is not mapped.
    [[nodiscard]] Registers registers(std::uint32_t number) const;
    /// The place of the next capability `id` behind `after`; 0: there is none. From the first with
    /// `after` = 0.
    [[nodiscard]] std::uint8_t capability(std::uint8_t id, std::uint8_t after = 0) const;

  private:
    explicit PciDevice(std::uint32_t place) : place_(place) {}
    static std::optional<PciDevice> find_on(std::uint32_t bus, std::uint32_t identity);

    std::uint32_t place_;  // bus, device and function, as the port takes them
};

}  // namespace qduino::board::metal
