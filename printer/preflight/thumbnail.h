// The picture that a slicer puts into its file: PNG in base64, in comments.
//
//     ; thumbnail begin 160x120 5544        width × height in pixels, characters of base64 below
//     ; iVBORw0KGgoAAAANSUhEUgAA…
//     ; thumbnail end
//
// A file may hold several; the largest whole one is kept. A picture is left out when it is longer
// than kThumbnailBytesMax, has another count of characters than announced, or is no PNG. The
// picture is a courtesy and never an error. (`thumbnail_JPG` and `thumbnail_QOI` are left out too.)
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace qduino::printer::preflight {

inline constexpr std::size_t kThumbnailBytesMax = 512 * 1024;

struct Thumbnail {
    std::uint32_t width_px = 0;
    std::uint32_t height_px = 0;
    std::vector<std::uint8_t> png;  ///< empty when the file has none
};

class ThumbnailReader {
  public:
    /// `comment`: the text behind the `;`. True when it was part of a thumbnail.
    bool on_comment(std::string_view comment);
    [[nodiscard]] const Thumbnail& best() const { return best_; }

  private:
    bool begin(std::string_view header);
    void add(std::string_view base64);
    void end();

    Thumbnail best_;
    Thumbnail current_;
    std::uint64_t characters_expected_ = 0;
    std::uint64_t characters_ = 0;
    std::uint32_t bits_ = 0;
    int bit_count_ = 0;
    bool reading_ = false;
    bool usable_ = false;
    bool padded_ = false;  ///< a `=` has been seen; nothing else may follow
};

}  // namespace qduino::printer::preflight
