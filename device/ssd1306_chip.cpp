#include "device/ssd1306_chip.h"

#include <algorithm>

namespace qduino::device {

namespace {

/// How many bytes belong to a command beside its own.
std::size_t arguments_of(std::uint8_t code) {
    switch (code) {
        case 0x20:  // addressing
        case 0x81:  // contrast
        case 0x8D:  // charge pump
        case 0xA8:  // rows
        case 0xD3:  // offset
        case 0xD5:  // clock
        case 0xD9:  // precharge
        case 0xDA:  // output pins
        case 0xDB:
            return 1;  // deselect level
        case 0x21:     // columns
        case 0x22:     // pages
        case 0xA3:
            return 2;  // scrolling rows
        case 0x29:     // scrolls
        case 0x2A:
            return 5;
        case 0x26:
        case 0x27:
            return 6;
        default:
            return 0;
    }
}

}  // namespace

void Ssd1306Chip::transfer(std::span<const std::uint8_t> written, std::span<std::uint8_t> read) {
    while (!written.empty()) {
        const std::uint8_t control = written[0];
        const bool is_data = (control & 0x40) != 0, one_alone = (control & 0x80) != 0;
        written = written.subspan(1);
        const std::size_t count = one_alone ? std::min<std::size_t>(1, written.size()) : written.size();
        for (const std::uint8_t byte : written.first(count)) is_data ? take_data(byte) : take_command(byte);
        written = written.subspan(count);
    }
    std::ranges::fill(read, static_cast<std::uint8_t>(show_.on ? 0x00 : 0x40));
}

void Ssd1306Chip::take_command(std::uint8_t byte) {
    if (command_.have < command_.wanted) {
        command_.arguments[command_.have++] = byte;
        if (command_.have == command_.wanted) complete(command_);
        return;
    }
    command_ = {.code = byte, .arguments = {}, .have = 0, .wanted = arguments_of(byte)};
    if (command_.wanted == 0) single(byte);
}

void Ssd1306Chip::single(std::uint8_t code) {
    if (code <= 0x0F) {
        column_ = (column_ & 0x70) | code;
    } else if (code <= 0x1F) {
        column_ = (column_ & 0x0F) | (code & 7) << 4;
    } else if (code >= 0x40 && code <= 0x7F) {
        show_.start_line = code & 63;
    } else if (code >= 0xB0 && code <= 0xB7) {
        page_ = code & 7;
    } else if (code == 0xA0 || code == 0xA1) {
        segments_remapped_ = code == 0xA1;
    } else if (code == 0xA4 || code == 0xA5) {
        show_.all_on = code == 0xA5;
    } else if (code == 0xA6 || code == 0xA7) {
        show_.inverse = code == 0xA7;
    } else if (code == 0xAE || code == 0xAF) {
        show_.on = code == 0xAF;
    } else if (code == 0xC0 || code == 0xC8) {
        show_.rows_remapped = code == 0xC8;
    } else if (code != 0x2E && code != 0x2F && code != 0xE3) {  // scrolling, and nothing at all
        ++unknown_;
    }
}

void Ssd1306Chip::complete(const Command& command) {
    const int first = command.arguments[0], second = command.arguments[1];
    switch (command.code) {
        case 0x20:
            mode_ = static_cast<Mode>(std::min(first & 3, 2));
            break;
        case 0x21:
            columns_ = {first & 127, second & 127};
            column_ = columns_.first;
            break;
        case 0x22:
            pages_ = {first & 7, second & 7};
            page_ = pages_.first;
            break;
        case 0xD3:
            show_.offset = first & 63;
            break;
        default:
            break;  // of the electrical side
    }
}

void Ssd1306Chip::take_data(std::uint8_t byte) {
    ++data_bytes_;
    const int physical = segments_remapped_ ? column_ : kWidth - 1 - column_;
    memory_[static_cast<std::size_t>(page_)][static_cast<std::size_t>(physical)] = byte;
    const auto advance = [](int& at, Range range) {
        const bool wraps = at == range.last;
        at = wraps ? range.first : at + 1;
        return wraps;
    };
    if (mode_ == Mode::horizontal) {
        if (advance(column_, columns_)) advance(page_, pages_);
    } else if (mode_ == Mode::vertical) {
        if (advance(page_, pages_)) advance(column_, columns_);
    } else {
        advance(column_, {0, kWidth - 1});
    }
    column_ &= kWidth - 1;
    page_ &= 7;
}

bool Ssd1306Chip::lit(int x, int y) const {
    if (!show_.on) return false;
    if (show_.all_on) return true;
    const int row = ((show_.rows_remapped ? y : height_ - 1 - y) + show_.start_line + show_.offset) % kRows;
    const std::uint8_t dots = memory_[static_cast<std::size_t>(row / 8)][static_cast<std::size_t>(x)];
    return ((dots >> (row % 8) & 1) != 0) != show_.inverse;
}

}  // namespace qduino::device
