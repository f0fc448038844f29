#include "report/picture/raster.h"

#include <png.h>
#include <sodium.h>

#include <algorithm>
#include <array>
#include <limits>

namespace qduino::apps::picture {

Raster::Raster(int width, int height)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)),
      distances_(pixels_.size(), std::numeric_limits<float>::infinity()) {}

void Raster::put(int x, int y, float distance, std::uint8_t colour) {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return;
    const std::size_t i =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    if (distance > distances_[i]) return;
    distances_[i] = distance;
    pixels_[i] = colour;
}

std::uint8_t Raster::at(int x, int y) const {
    if (x < 0 || y < 0 || x >= width_ || y >= height_) return 0;
    return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(x)];
}

std::string Raster::png(std::span<const Colour> palette) const {
    std::array<std::uint8_t, 256 * 4> colours{};
    for (std::size_t i = 1; i < std::min<std::size_t>(palette.size(), 256); ++i) {
        const Colour& colour = palette[i];
        const std::array<std::uint8_t, 4> rgba{colour.red, colour.green, colour.blue, 255};
        std::ranges::copy(rgba, colours.begin() + static_cast<std::ptrdiff_t>(4 * i));
    }
    png_image image{};
    image.version = PNG_IMAGE_VERSION;
    image.width = static_cast<png_uint_32>(width_);
    image.height = static_cast<png_uint_32>(height_);
    image.format = PNG_FORMAT_RGBA_COLORMAP;
    image.colormap_entries = 256;
    // The most that a picture of this size can take. The write puts what it took in its place.
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(image);
    std::string out(size, '\0');
    const int written =
        png_image_write_to_memory(&image, out.data(), &size, 0, pixels_.data(), 0, colours.data());
    out.resize(written != 0 ? size : 0);
    return out;
}

std::string data_address(const std::string& png) {
    constexpr int kVariant = sodium_base64_VARIANT_ORIGINAL;
    std::string text(sodium_base64_encoded_len(png.size(), kVariant), '\0');
    sodium_bin2base64(text.data(), text.size(), reinterpret_cast<const unsigned char*>(png.data()),
                      png.size(), kVariant);
    text.pop_back();  // the terminating zero
    return "data:image/png;base64," + text;
}

}  // namespace qduino::apps::picture
