#include "device/ds18b20_chip.h"

#include <algorithm>
#include <cmath>

#include "device/one_wire_crc.h"

namespace qduino::device {

namespace {

constexpr Nanoseconds kLongestOne{15'000}, kShortestZero{60'000}, kLongestZero{120'000};

}  // namespace

Ds18b20Chip::Ds18b20Chip(std::uint64_t serial, double celsius) : celsius_(celsius) {
    rom_[0] = 0x28;  // the family
    for (std::size_t i = 0; i < 6; ++i) rom_[i + 1] = static_cast<std::uint8_t>(serial >> (8 * i));
    rom_[7] = one_wire_crc(std::span(rom_).first(7));
    set_temperature(85.0);  // until the first conversion
}

void Ds18b20Chip::master(Instant now, bool high) {
    if (high == slot_.bus) return;
    slot_.bus = high;
    finish_conversion(now);
    return high ? released(now) : pulled(now);
}

void Ds18b20Chip::pulled(Instant now) {
    slot_.fell = now;
    if (next_bit()) return;
    slot_.from = now;
    slot_.until = now + kSample;
}

void Ds18b20Chip::released(Instant now) {
    const Nanoseconds low = now - slot_.fell;
    if (low >= kReset) {
        wait_for(Wants::rom_command);
        slot_.from = now + kPresenceFrom;
        slot_.until = slot_.from + kPresence;
        return;
    }
    if (low > kLongestZero || (low > kLongestOne && low < kShortestZero)) ++unclear_;
    if (!slot_.chip_speaks) take_bit(now, low < kSample);
}

bool Ds18b20Chip::next_bit() {
    slot_.chip_speaks = true;
    if (wants_ == Wants::convert) return !converted_;
    if (wants_ == Wants::search && bits_ % 3 != 2) {
        const bool bit = rom_bit(bits_ / 3);
        return bits_++ % 3 == 0 ? bit : !bit;
    }
    if (wants_ == Wants::answer) {
        if (bits_ == 8 * answer_.size()) return true;
        const bool bit = ((answer_[bits_ / 8] >> (bits_ % 8)) & 1) != 0;
        ++bits_;
        return bit;
    }
    slot_.chip_speaks = false;
    return true;
}

void Ds18b20Chip::take_bit(Instant now, bool bit) {
    if (wants_ == Wants::nothing) return;
    if (wants_ == Wants::match || wants_ == Wants::search) return take_address_bit(bit);
    byte_ |= unsigned{bit} << (bits_ % 8);
    if (++bits_ % 8 != 0) return;
    const auto byte = static_cast<std::uint8_t>(byte_);
    byte_ = 0;
    take_byte(now, byte);
}

void Ds18b20Chip::take_address_bit(bool bit) {
    const std::size_t step = wants_ == Wants::match ? 1 : 3;
    const bool is_meant = bit == rom_bit(bits_ / step);
    ++bits_;
    if (!is_meant) return wait_for(Wants::nothing);
    if (bits_ == 8 * rom_.size() * step) wait_for(Wants::function);
}

void Ds18b20Chip::take_byte(Instant now, std::uint8_t byte) {
    if (wants_ == Wants::rom_command) return rom_command(byte);
    if (wants_ == Wants::function) return function_command(now, byte);
    scratchpad_[kHigh + bits_ / 8 - 1] = byte;
    seal();
    if (bits_ == 24) wait_for(Wants::nothing);
}

void Ds18b20Chip::wait_for(Wants what) {
    wants_ = what;
    bits_ = 0;
    byte_ = 0;
}

void Ds18b20Chip::say(std::span<const std::uint8_t> bytes) {
    wait_for(Wants::answer);
    answer_ = bytes;
}

void Ds18b20Chip::rom_command(std::uint8_t command) {
    switch (command) {
        case 0x33:
            return say(rom_);
        case 0x55:
            return wait_for(Wants::match);
        case 0xCC:
            return wait_for(Wants::function);
        case 0xF0:
            return wait_for(Wants::search);
        case 0xEC:
            return wait_for(alarm() ? Wants::search : Wants::nothing);
        default:
            return wait_for(Wants::nothing);
    }
}

void Ds18b20Chip::function_command(Instant now, std::uint8_t command) {
    static constexpr std::array<std::uint8_t, 1> kHasPower{0xFF};
    wait_for(Wants::nothing);
    switch (command) {
        case 0x44:
            wait_for(Wants::convert);
            converted_ = now + kConversion / (1 << (12 - resolution()));
            break;
        case 0x4E:
            wait_for(Wants::scratchpad);
            break;
        case 0xBE:
            say(scratchpad_);
            break;
        case 0xB4:
            say(kHasPower);
            break;
        case 0x48:
            std::copy_n(scratchpad_.begin() + kHigh, kept_.size(), kept_.begin());
            break;
        case 0xB8:
            std::ranges::copy(kept_, scratchpad_.begin() + kHigh);
            seal();
            break;
        default:
            break;
    }
}

void Ds18b20Chip::finish_conversion(Instant now) {
    if (!converted_ || now < *converted_) return;
    converted_.reset();
    ++conversions_;
    set_temperature(celsius_);
}

void Ds18b20Chip::set_temperature(double celsius) {
    const auto steps = static_cast<int>(std::lround(std::clamp(celsius, -55.0, 125.0) * 16));
    const int undefined = (1 << (12 - resolution())) - 1;
    const auto shown = static_cast<unsigned>(steps & ~undefined);
    scratchpad_[0] = static_cast<std::uint8_t>(shown & 0xFF);
    scratchpad_[1] = static_cast<std::uint8_t>(shown >> 8 & 0xFF);
    seal();
}

void Ds18b20Chip::seal() {
    scratchpad_[kConfig] = static_cast<std::uint8_t>((scratchpad_[kConfig] & 0x60) | 0x1F);
    scratchpad_[kCrc] = one_wire_crc(std::span(scratchpad_).first(kCrc));
}

bool Ds18b20Chip::alarm() const {
    const auto celsius = static_cast<std::int8_t>(scratchpad_[1] << 4 | scratchpad_[0] >> 4);
    return celsius >= static_cast<std::int8_t>(scratchpad_[kHigh]) ||
           celsius <= static_cast<std::int8_t>(scratchpad_[kHigh + 1]);
}

}  // namespace qduino::device
