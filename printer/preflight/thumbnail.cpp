#include "printer/preflight/thumbnail.h"

#include <algorithm>
#include <array>

#include "printer/gcode/text.h"

namespace qduino::printer::preflight {
namespace {

using namespace gcode;

constexpr std::uint32_t kPixelsMax = 4096;  ///< of a side
constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1A, '\n'};

/// RFC 4648, table 1: each character at its value.
constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

}  // namespace

bool ThumbnailReader::on_comment(std::string_view comment) {
    comment = trim(comment);
    if (skip_prefix(comment, "thumbnail begin ")) return begin(comment);
    if (!reading_) return false;
    if (comment == "thumbnail end") {
        end();
    } else {
        add(comment);
    }
    return true;
}

bool ThumbnailReader::begin(std::string_view header) {
    const auto width = take_integer(header);
    const bool has_x = skip_prefix(header, "x");
    const auto height = take_integer(header);
    header = trim(header);
    const auto characters = take_integer(header);
    reading_ = true;
    usable_ = width && has_x && height && characters && *width <= kPixelsMax && *height <= kPixelsMax;
    current_.png.clear();
    current_.width_px = usable_ ? static_cast<std::uint32_t>(*width) : 0;
    current_.height_px = usable_ ? static_cast<std::uint32_t>(*height) : 0;
    characters_expected_ = characters.value_or(0);
    characters_ = 0;
    bits_ = 0;
    bit_count_ = 0;
    padded_ = false;
    return true;
}

void ThumbnailReader::add(std::string_view base64) {
    for (const char c : base64) {
        if (!usable_) return;
        ++characters_;
        if (c == '=') {
            padded_ = true;
            continue;
        }
        const std::size_t value = kBase64.find(c);
        usable_ = value < kBase64.size() && !padded_ && current_.png.size() < kThumbnailBytesMax;
        if (!usable_) return;
        bits_ = (bits_ << 6 | static_cast<std::uint32_t>(value)) & 0xFFFF;
        bit_count_ += 6;
        if (bit_count_ < 8) continue;
        bit_count_ -= 8;
        current_.png.push_back(static_cast<std::uint8_t>(bits_ >> bit_count_));
    }
}

void ThumbnailReader::end() {
    reading_ = false;
    const auto& png = current_.png;
    const bool whole = usable_ && characters_ == characters_expected_ && png.size() > kPngSignature.size() &&
                       std::equal(kPngSignature.begin(), kPngSignature.end(), png.begin());
    const auto area = [](const Thumbnail& t) { return std::uint64_t{t.width_px} * t.height_px; };
    if (whole && area(current_) > area(best_)) std::swap(best_, current_);
    current_.png.clear();
}

}  // namespace qduino::printer::preflight
