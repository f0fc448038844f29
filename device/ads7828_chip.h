// ADS7828: the chip's side. Decodes the transactions that a driver really sends, as the chip would.
//
// Source: Texas Instruments, ADS7828 data sheet (SBAS181), tables "Channel selection control" and
// "Power-down selection".
//
//   SD C2 C1 C0   +IN  -IN          SD C2 C1 C0   +IN  -IN
//    1  0  0  0   CH0  COM           0  0  0  0   CH0  CH1
//    1  0  0  1   CH2  COM           0  0  0  1   CH2  CH3
//    1  0  1  0   CH4  COM           0  0  1  0   CH4  CH5
//    1  0  1  1   CH6  COM           0  0  1  1   CH6  CH7
//    1  1  0  0   CH1  COM           0  1  0  0   CH1  CH0
//    1  1  0  1   CH3  COM           0  1  0  1   CH3  CH2
//    1  1  1  0   CH5  COM           0  1  1  0   CH5  CH4
//    1  1  1  1   CH7  COM           0  1  1  1   CH7  CH6
//
// A command stays in force until the next one, so a read alone converts the same channel again. The
// table is written out, and not computed with the driver's formula, so that each side catches the
// other's mistakes.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

namespace qduino::device {

class Ads7828Chip {
  public:
    /// `reference_v`: what is wired to the REF pin, volts.
    explicit constexpr Ads7828Chip(double reference_v) : reference_v_(reference_v) {}

    /// One transaction: the bytes written, then, after a repeated start, the bytes to be read.
    /// `volts_of(channel)` gives the voltage on an input against COM. It is called for the selected
    /// channels only.
    template <typename VoltsOf>
    void transfer(std::span<const std::uint8_t> written, std::span<std::uint8_t> read, VoltsOf&& volts_of) {
        if (!written.empty()) command_ = written.back();
        if (read.empty()) return;
        const Inputs inputs = kInputs[command_ >> 4];
        double volts = volts_of(static_cast<int>(inputs.plus));
        if (inputs.minus != kCom) volts -= volts_of(static_cast<int>(inputs.minus));
        const int result = convert(volts);
        // A read past two bytes converts again, so the pair repeats.
        for (std::size_t i = 0; i < read.size(); ++i)
            read[i] = static_cast<std::uint8_t>(i % 2 == 0 ? result >> 8 : result & 0xFF);
    }

    /// What one step of the result means now.
    [[nodiscard]] constexpr double reference_v() const { return (command_ & 0x08) != 0 ? 2.5 : reference_v_; }

  private:
    static constexpr std::uint8_t kCom = 0xFF;
    struct Inputs {
        std::uint8_t plus, minus;
    };
    // Indexed by SD C2 C1 C0.
    static constexpr std::array<Inputs, 16> kInputs{{{0, 1},
                                                     {2, 3},
                                                     {4, 5},
                                                     {6, 7},
                                                     {1, 0},
                                                     {3, 2},
                                                     {5, 4},
                                                     {7, 6},
                                                     {0, kCom},
                                                     {2, kCom},
                                                     {4, kCom},
                                                     {6, kCom},
                                                     {1, kCom},
                                                     {3, kCom},
                                                     {5, kCom},
                                                     {7, kCom}}};

    /// Straight binary, saturating at both ends.
    [[nodiscard]] int convert(double volts) const {
        return static_cast<int>(std::clamp(std::floor(volts / reference_v() * 4096.0), 0.0, 4095.0));
    }

    double reference_v_;
    std::uint8_t command_ = 0;  // power-on state: differential 0/1, external reference
};

}  // namespace qduino::device
