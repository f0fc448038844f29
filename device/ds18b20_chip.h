// DS18B20: the chip's side. A thermometer on a 1-Wire bus, with power of its own.
//
//          reset ≥ 480 µs   presence        write 1   write 0        read 0 (the chip holds it)
//   bus  ▔▔▁▁▁▁▁▁▁▁▁▁▁▁▔▔▔▁▁▁▁▁▔▔▔▔▔▔▔▔▔▔▔▔▁▔▔▔▔▔▔▔▁▁▁▁▁▁▁▔▔▔▔▔▔▔▁▁▁▁▁▔▔▔▔
//                       30 µs 120 µs
//
// The bus has a pull-up; master and chips only pull it low. A slot begins with the master's falling
// edge. The chip takes a bit 30 µs later, and holds a 0 that it sends for as long.
//
//   idle ── reset ──► ROM command ── 0x55, 0xCC, 0xF0 … ──► function command ──► bytes out or in
//
// Source: Maxim, DS18B20 data sheet (19-7487), figures 5, 6, 11, 14 and 15; Maxim, application note
// 187 (the search).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "base/time.h"

namespace qduino::device {

class Ds18b20Chip {
  public:
    static constexpr Nanoseconds kReset{480'000};
    static constexpr Nanoseconds kPresenceFrom{30'000}, kPresence{120'000};  // 15…60, 60…240 µs
    static constexpr Nanoseconds kSample{30'000};                            // 15…60 µs
    /// The time of a conversion with twelve bits; each bit less halves it.
    static constexpr Nanoseconds kConversion{750'000'000};

    /// `serial`: 48 bits. `celsius`: what it measures, −55 to 125 °C.
    Ds18b20Chip(std::uint64_t serial, double celsius);
    Ds18b20Chip(const Ds18b20Chip&) = delete;  // an answer points into it
    Ds18b20Chip& operator=(const Ds18b20Chip&) = delete;

    /// The master pulls the bus low (false) or lets it go, from `now` on.
    void master(Instant now, bool high);
    /// True while this chip pulls the bus low.
    [[nodiscard]] bool pulls(Instant now) const { return slot_.from <= now && now < slot_.until; }

    [[nodiscard]] const std::array<std::uint8_t, 8>& rom() const { return rom_; }
    [[nodiscard]] std::uint64_t conversions() const { return conversions_; }
    /// Low pulses of the master that are neither a 0 nor a 1 by the data sheet: between 15 and 60
    /// µs, or between a slot and a reset.
    [[nodiscard]] std::uint64_t unclear_slots() const { return unclear_; }

  private:
    enum class Wants : std::uint8_t {
        nothing,
        rom_command,
        match,
        search,
        function,
        scratchpad,
        answer,
        convert
    };
    using Scratchpad = std::array<std::uint8_t, 9>;

    void pulled(Instant now);
    void released(Instant now);
    /// What the chip says in the slot that begins: true for a 1, and where it says nothing.
    bool next_bit();
    void take_bit(Instant now, bool bit);
    void take_address_bit(bool bit);
    void take_byte(Instant now, std::uint8_t byte);
    void wait_for(Wants what);
    void say(std::span<const std::uint8_t> bytes);
    void rom_command(std::uint8_t command);
    void function_command(Instant now, std::uint8_t command);
    void finish_conversion(Instant now);
    void set_temperature(double celsius);
    /// Puts the fixed bits and the CRC into the scratchpad.
    void seal();
    [[nodiscard]] int resolution() const { return 9 + (scratchpad_[kConfig] >> 5 & 3); }
    [[nodiscard]] bool alarm() const;
    [[nodiscard]] bool rom_bit(std::size_t index) const {
        return ((rom_[index / 8] >> (index % 8)) & 1) != 0;
    }

    static constexpr std::size_t kHigh = 2, kConfig = 4, kCrc = 8;

    double celsius_;
    std::array<std::uint8_t, 8> rom_{};
    /// Temperature, alarms, configuration (twelve bits), three of no use, CRC.
    Scratchpad scratchpad_{0, 0, 0x4B, 0x46, 0x7F, 0xFF, 0x0C, 0x10, 0};
    std::array<std::uint8_t, 3> kept_{0x4B, 0x46, 0x7F};  // alarms and configuration, without power
    struct Slot {
        Instant fell{};            // the master's last edge down
        Instant from{}, until{};   // the chip pulls
        bool bus = true;           // the master lets it be high
        bool chip_speaks = false;  // in this slot
    };
    Slot slot_;
    Wants wants_ = Wants::nothing;
    std::size_t bits_ = 0;  // of what it wants
    unsigned byte_ = 0;     // of these, the last ones
    std::span<const std::uint8_t> answer_;
    std::optional<Instant> converted_;  // when the running conversion ends
    std::uint64_t conversions_ = 0, unclear_ = 0;
};

}  // namespace qduino::device
