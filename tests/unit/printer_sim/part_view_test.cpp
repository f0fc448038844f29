#include "apps/printer_sim/part_view.h"

#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>

namespace qduino::apps::part_view_test {
namespace {

using picture::Colour;
using picture::Raster;
using twin::HeightCell;

/// The pixels of a PNG, as red, green, blue and opacity.
struct Pixels {
    explicit Pixels(const std::string& png) {
        png_image image{};
        image.version = PNG_IMAGE_VERSION;
        good = png_image_begin_read_from_memory(&image, png.data(), png.size()) != 0;
        if (!good) return;
        image.format = PNG_FORMAT_RGBA;
        width = image.width;
        height = image.height;
        bytes.resize(PNG_IMAGE_SIZE(image));
        good = png_image_finish_read(&image, nullptr, bytes.data(), 0, nullptr) != 0;
    }
    [[nodiscard]] std::array<int, 4> at(unsigned x, unsigned y) const {
        const std::size_t i = 4 * (std::size_t{y} * width + x);
        return {bytes[i], bytes[i + 1], bytes[i + 2], bytes[i + 3]};
    }
    bool good = false;
    unsigned width = 0, height = 0;
    std::vector<std::uint8_t> bytes;
};

TEST(Raster, NearerThingsCoverFartherOnesInAnyOrder) {
    for (const bool near_first : {true, false}) {
        Raster raster(20, 20);
        const auto stroke = [&](bool near) {
            raster.stroke({2, 10, near ? 1.0f : 5.0f}, {18, 10, near ? 1.0f : 5.0f}, 4,
                          [=](float) { return static_cast<std::uint8_t>(near ? 1 : 2); });
        };
        stroke(near_first);
        stroke(!near_first);
        EXPECT_EQ(raster.at(10, 10), 1);
        EXPECT_EQ(raster.at(10, 16), 0);
        EXPECT_EQ(raster.at(-1, 30), 0);
    }
}

TEST(Raster, IsAPngOfItsColoursWhereNothingIsTransparent) {
    Raster raster(9, 5);
    raster.stroke({4, 2, 0}, {4, 2, 0}, 1, [](float) { return std::uint8_t{1}; });
    // Outside:
    raster.stroke({-50, -50, 0}, {-40, -50, 0}, 3, [](float) { return std::uint8_t{1}; });
    const std::array<Colour, 2> palette{Colour{}, Colour{10, 20, 30}};
    const Pixels pixels(raster.png(palette));
    ASSERT_TRUE(pixels.good);
    EXPECT_EQ(pixels.width, 9u);
    EXPECT_EQ(pixels.height, 5u);
    EXPECT_EQ(pixels.at(4, 2), (std::array<int, 4>{10, 20, 30, 255}));
    EXPECT_EQ(pixels.at(0, 0)[3], 0);
}

TEST(Raster, ItsAddressIsBase64) {
    EXPECT_EQ(picture::data_address("Man"), "data:image/png;base64,TWFu");
    EXPECT_EQ(picture::data_address("M"), "data:image/png;base64,TQ==");
}

/// A line along X at `y`, of `count` cells, and of one error.
void line(std::vector<HeightCell>& cells, float y, float z, float error, int count = 20) {
    for (int i = 0; i <= count; ++i) cells.push_back({0.4f * static_cast<float>(i), y, z, error, i > 0});
}

bool is_bluish(const std::array<int, 4>& c) { return c[2] > c[0] + 40; }
bool is_reddish(const std::array<int, 4>& c) { return c[0] > c[2] + 40; }

TEST(PartView, ALineHasTheColourOfItsErrorAtItsPlace) {
    std::vector<HeightCell> cells;
    line(cells, 0, 0.2f, -0.3f);
    line(cells, 4, 0.2f, 0.0f);
    line(cells, 8, 0.2f, 0.3f);
    const PartView view(cells, ViewFrom::above, 400, 400, 0.4);
    const Pixels pixels(view.png());
    ASSERT_TRUE(pixels.good);
    const auto at = [&](double y) {
        const picture::Spot spot = view.spot(4, y, 0.2);
        return pixels.at(static_cast<unsigned>(spot.x), static_cast<unsigned>(spot.y));
    };
    EXPECT_TRUE(is_bluish(at(0)));
    EXPECT_FALSE(is_bluish(at(4)) || is_reddish(at(4)));
    EXPECT_TRUE(is_reddish(at(8)));
    EXPECT_EQ(at(2)[3], 0) << "nothing between two lines";
    EXPECT_LT(view.spot(4, 8, 0.2).y, view.spot(4, 0, 0.2).y) << "Y is upwards";
}

TEST(PartView, FromAboveOnlyTheUppermostIsSeen) {
    std::vector<HeightCell> cells;
    line(cells, 0, 0.4f, 0.3f);
    line(cells, 0, 0.2f, -0.3f);  // later in the list, and lower
    line(cells, 3, 0.2f, 0);
    const PartView view(cells, ViewFrom::above, 200, 200, 0.4);
    const picture::Spot spot = view.spot(4, 0, 0.4);
    EXPECT_TRUE(
        is_reddish(Pixels(view.png()).at(static_cast<unsigned>(spot.x), static_cast<unsigned>(spot.y))));
}

TEST(PartView, FromTheCornerTheFrontCoversTheBack) {
    std::vector<HeightCell> cells;
    for (int layer = 0; layer < 40; ++layer) line(cells, 0, 0.2f * static_cast<float>(layer), 0.3f);
    for (int layer = 0; layer < 20; ++layer) line(cells, 1, 0.2f * static_cast<float>(layer), -0.3f);
    const PartView view(cells, ViewFrom::corner, 300, 300, 0.4);
    const picture::Spot front = view.spot(4, 0, 4);
    EXPECT_TRUE(
        is_reddish(Pixels(view.png()).at(static_cast<unsigned>(front.x), static_cast<unsigned>(front.y))));
}

TEST(PartView, NothingIsAnEmptyPictureAndOneCellIsNoTrouble) {
    EXPECT_TRUE(Pixels(PartView({}, ViewFrom::corner, 30, 20, 0.4).png()).good);
    const std::vector<HeightCell> one{{1, 2, 3, 0.1f, false}};
    EXPECT_TRUE(Pixels(PartView(one, ViewFrom::above, 30, 20, 0.4).png()).good);
}

TEST(CellsOfLayer, CountsFromBelowWhateverTheOrder) {
    std::vector<HeightCell> cells;
    line(cells, 0, 0.5f, 0.2f, 3);
    line(cells, 0, 0.2f, 0.1f, 3);
    line(cells, 0, 0.501f, 0.3f, 3);
    ASSERT_EQ(cells_of_layer(cells, 1).size(), 4u);
    EXPECT_FLOAT_EQ(cells_of_layer(cells, 1)[0].error, 0.1f);
    EXPECT_EQ(cells_of_layer(cells, 2).size(), 8u);
    EXPECT_TRUE(cells_of_layer(cells, 3).empty());
    EXPECT_TRUE(cells_of_layer(cells, 0).empty());
}

}  // namespace
}  // namespace qduino::apps::part_view_test
