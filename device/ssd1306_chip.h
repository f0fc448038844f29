// SSD1306: the chip's side, on I2C. A display of 128 columns and 64 (or 32) rows of dots.
//
//   transaction   [control][…]           control 0x00: commands, 0x40: data; bit 7: one byte, and
//                                        another control byte behind it
//   memory        8 pages × 128 columns  a byte is eight dots of a column, the lowest bit on top
//
// Source: Solomon Systech, SSD1306 data sheet, rev. 1.1: 8.1.5.2 (I2C), 8.7 (memory), 9 and 10
// (commands).
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace qduino::device {

class Ssd1306Chip {
  public:
    static constexpr int kWidth = 128, kRows = 64;

    /// `height`: how many rows the glass has, 64 or 32.
    explicit Ssd1306Chip(int height) : height_(height) {}

    /// One transaction: the bytes written, then those to be read (the status, again and again).
    void transfer(std::span<const std::uint8_t> written, std::span<std::uint8_t> read);

    /// True when this dot shines; (0, 0) is in the upper left of a module that is mounted for
    /// remapped segments and outputs (commands A1, C8), as they all are.
    [[nodiscard]] bool lit(int x, int y) const;
    [[nodiscard]] bool is_on() const { return show_.on; }
    [[nodiscard]] int height() const { return height_; }
    /// Bytes of data taken, and of commands that the data sheet does not have.
    [[nodiscard]] std::uint64_t data_bytes() const { return data_bytes_; }
    [[nodiscard]] std::uint64_t unknown_commands() const { return unknown_; }

  private:
    enum class Mode : std::uint8_t { horizontal, vertical, page };
    struct Range {
        int first, last;
    };
    /// A command whose arguments are still to come.
    struct Command {
        std::uint8_t code = 0;
        std::array<std::uint8_t, 6> arguments{};
        std::size_t have = 0, wanted = 0;
    };

    void take_command(std::uint8_t byte);
    void single(std::uint8_t code);
    void complete(const Command& command);
    void take_data(std::uint8_t byte);

    int height_;
    std::array<std::array<std::uint8_t, kWidth>, kRows / 8> memory_{};  // by physical column
    Command command_;
    Mode mode_ = Mode::page;
    Range columns_{0, kWidth - 1}, pages_{0, kRows / 8 - 1};
    int column_ = 0, page_ = 0;
    bool segments_remapped_ = false;
    /// How the memory is shown.
    struct Show {
        int start_line = 0, offset = 0;
        bool on = false, inverse = false, all_on = false, rows_remapped = false;
    };
    Show show_;
    std::uint64_t data_bytes_ = 0, unknown_ = 0;
};

}  // namespace qduino::device
