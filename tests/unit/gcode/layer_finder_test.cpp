#include "printer/gcode/layer_finder.h"

#include <gtest/gtest.h>

namespace qduino::printer::gcode::layer_finder_test {
namespace {

using Found = LayerFinder::Found;

TEST(LayerFinder, ByHeightWhereNoCommentSpeaksOfLayers) {
    LayerFinder finder;
    EXPECT_EQ(finder.on_extrusion(0.3), Found::first);
    EXPECT_EQ(finder.on_extrusion(0.33), Found::same);
    EXPECT_EQ(finder.on_extrusion(0.6), Found::risen);
    EXPECT_FALSE(finder.on_annotation(parse_annotation("TYPE:Skirt")));
    EXPECT_EQ(finder.on_extrusion(0.3), Found::risen) << "another object, one by one";
    EXPECT_EQ(finder.layers(), 3u);
}

TEST(LayerFinder, ByCommentsHoweverZRises) {
    LayerFinder finder;
    EXPECT_EQ(finder.on_extrusion(0.25), Found::first) << "a priming line";
    EXPECT_TRUE(finder.on_annotation(parse_annotation("LAYER_CHANGE")));
    EXPECT_FALSE(finder.on_annotation(parse_annotation("LAYER_CHANGE"))) << "nothing was laid down";
    EXPECT_EQ(finder.layers(), 1u);
    EXPECT_EQ(finder.on_extrusion(0.2), Found::named);
    EXPECT_EQ(finder.on_extrusion(5), Found::same);
    EXPECT_TRUE(finder.on_annotation(parse_annotation("LAYER_CHANGE")));
    EXPECT_EQ(finder.on_extrusion(5), Found::commented);
    EXPECT_EQ(finder.layers(), 2u);
}

}  // namespace
}  // namespace qduino::printer::gcode::layer_finder_test
