// FastLED's sets of pixels: a piece of an array, forwards or backwards, on which all the fills
// work.
#pragma once

#include "arduino/libraries/FastLED/fastled/fills.h"

template <typename Pixel>
class CPixelView {
  public:
    CPixelView(Pixel* pixels, int count) : first_(pixels), way_(1), count_(count) {}
    /// With both ends; backwards where `last` is before `first`.
    CPixelView(Pixel* pixels, int first, int last)
        : first_(pixels + first), way_(last < first ? -1 : 1), count_((last - first) * way_ + 1) {}
    CPixelView(const CPixelView& other) = default;

    [[nodiscard]] int size() const { return count_; }
    [[nodiscard]] bool reversed() const { return way_ < 0; }
    Pixel& operator[](int i) const { return first_[i * way_]; }
    /// Pixels `first` to `last` of these.
    CPixelView operator()(int first, int last) const { return CPixelView(first_, first * way_, last * way_); }
    CPixelView operator-() const { return (*this)(count_ - 1, 0); }
    operator Pixel*() const { return first_; }

    /// As many as both have.
    CPixelView& operator=(const CPixelView& other) {
        return each_with(other, [](Pixel& mine, const Pixel& its) { mine = its; });
    }
    CPixelView& operator=(const Pixel& color) { return fill_solid(color); }
    CPixelView& fill_solid(const Pixel& color) {
        return each([&color](Pixel& pixel) { pixel = color; });
    }
    CPixelView& fill_rainbow(std::uint8_t hue, std::uint8_t step = 5) {
        return each([&hue, step](Pixel& pixel) {
            pixel = CHSV(hue, 240, 255);
            hue = add8(hue, step);
        });
    }
    /// From end to end, through two to four colours.
    template <typename... Colors>
    CPixelView& fill_gradient(const Colors&... colors) {
        return as_array(
            [&](Pixel* pixels, std::uint16_t count) { ::fill_gradient(pixels, count, colors...); });
    }
    template <typename... Colors>
    CPixelView& fill_gradient_RGB(const Colors&... colors) {
        return as_array(
            [&](Pixel* pixels, std::uint16_t count) { ::fill_gradient_RGB(pixels, count, colors...); });
    }
    CPixelView& blur1d(fract8 amount) {
        qduino::arduino::fastled::blur_line(count_, amount, [this](int i) -> Pixel& { return (*this)[i]; });
        return *this;
    }
    CPixelView& nblend(const Pixel& more, fract8 amount) {
        return each([&](Pixel& pixel) { ::nblend(pixel, more, amount); });
    }
    CPixelView& nblend(const CPixelView& more, fract8 amount) {
        return each_with(more, [amount](Pixel& mine, const Pixel& its) { ::nblend(mine, its, amount); });
    }
    CPixelView& nscale8(std::uint8_t scale) {
        return each([scale](Pixel& pixel) { pixel.nscale8(scale); });
    }
    CPixelView& nscale8_video(std::uint8_t scale) {
        return each([scale](Pixel& pixel) { pixel.nscale8_video(scale); });
    }
    CPixelView& operator%=(std::uint8_t scale) { return nscale8_video(scale); }
    CPixelView& fadeLightBy(std::uint8_t by) { return nscale8_video(sub8(255, by)); }
    CPixelView& fadeToBlackBy(std::uint8_t by) { return nscale8(sub8(255, by)); }
    CPixelView& addToRGB(std::uint8_t more) {
        return each([more](Pixel& pixel) { pixel.addToRGB(more); });
    }
    CPixelView& subtractFromRGB(std::uint8_t less) {
        return each([less](Pixel& pixel) { pixel.subtractFromRGB(less); });
    }
    CPixelView& operator+=(const CPixelView& other) {
        return each_with(other, [](Pixel& mine, const Pixel& its) { mine += its; });
    }
    CPixelView& operator-=(const CPixelView& other) {
        return each_with(other, [](Pixel& mine, const Pixel& its) { mine -= its; });
    }
    CPixelView& operator*=(std::uint8_t by) {
        return each([by](Pixel& pixel) { pixel *= by; });
    }
    CPixelView& operator/=(std::uint8_t by) {
        return each([by](Pixel& pixel) { pixel /= by; });
    }
    bool operator==(const CPixelView& other) const {
        for (int i = 0; i < count_; ++i) {
            if (count_ != other.count_ || !((*this)[i] == other[i])) return false;
        }
        return count_ == other.count_;
    }
    /// Any pixel that is not black.
    explicit operator bool() const {
        for (Pixel& pixel : *this) {
            if (static_cast<bool>(pixel)) return true;
        }
        return false;
    }

    class iterator {
      public:
        iterator(Pixel* at, int way) : at_(at), way_(way) {}
        Pixel& operator*() const { return *at_; }
        Pixel* operator->() const { return at_; }
        iterator& operator++() {
            at_ += way_;
            return *this;
        }
        bool operator==(const iterator& other) const { return at_ == other.at_; }

      private:
        Pixel* at_;
        int way_;
    };
    [[nodiscard]] iterator begin() const { return iterator(first_, way_); }
    [[nodiscard]] iterator end() const { return iterator(first_ + count_ * way_, way_); }

  private:
    template <typename Change>
    CPixelView& each(Change change) {
        for (Pixel& pixel : *this) change(pixel);
        return *this;
    }
    template <typename Change>
    CPixelView& each_with(const CPixelView& other, Change change) {
        for (int i = 0; i < std::min(count_, other.count_); ++i) change((*this)[i], other[i]);
        return *this;
    }
    /// `fill` makes an array, which is turned round afterwards where the set is.
    template <typename Fill>
    CPixelView& as_array(Fill fill) {
        Pixel* const pixels = way_ < 0 ? first_ - (count_ - 1) : first_;
        fill(pixels, static_cast<std::uint16_t>(count_));
        if (way_ < 0) std::reverse(pixels, pixels + count_);
        return *this;
    }

    Pixel* first_;
    int way_, count_;
};

using CRGBSet = CPixelView<CRGB>;
using CHSVSet = CPixelView<CHSV>;

/// An array of pixels that is a set as well.
template <int Size>
class CRGBArray : public CPixelView<CRGB> {
  public:
    CRGBArray() : CPixelView<CRGB>(pixels_, Size) {}
    CRGBArray(const CRGBArray& other) : CPixelView<CRGB>(pixels_, Size) { *this = other; }
    CRGBArray& operator=(const CRGBArray& other) {
        CPixelView<CRGB>::operator=(other);
        return *this;
    }
    using CPixelView<CRGB>::operator=;

  private:
    CRGB pixels_[Size];
};
