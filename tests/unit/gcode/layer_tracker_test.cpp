#include "printer/preflight/layer_tracker.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "printer/preflight/preflight.h"

namespace qduino::printer::preflight::layer_tracker_test {
namespace {

/// The layers of a program, as "index z height first_byte", one for each in which something is
/// extruded.
class Layers : public MoveSink {
  public:
    void on_move(const gcode::Move&, const MoveContext& context) override {
        if (!context.extrudes) return;
        const Layer& layer = context.layer;
        if (layers.empty() || layers.back().index != layer.index) layers.push_back(layer);
        layers.back() = layer;
    }
    std::vector<Layer> layers;
};

std::vector<Layer> layers_of(const std::string& program) {
    Preflight preflight{MachineConfig{}};
    Layers sink;
    preflight.add_sink(sink);
    const std::string text = "G28\nM109 S200\nM83\n" + program;
    preflight.feed(std::span<const char>{text.data(), text.size()});
    EXPECT_EQ(preflight.finish().layers, sink.layers.size());
    return sink.layers;
}

TEST(LayerTracker, PrusaSlicersComments) {
    const auto layers = layers_of(
        ";LAYER_CHANGE\n;Z:0.2\n;HEIGHT:0.2\nG1 Z.2\nG1 X10 E1\n"
        ";LAYER_CHANGE\n;Z:0.35\n;HEIGHT:0.15\nG1 Z.35\nG1 X20 E1\n");
    ASSERT_EQ(layers.size(), 2U);
    EXPECT_DOUBLE_EQ(layers[0].z_mm, 0.2);
    EXPECT_DOUBLE_EQ(layers[1].z_mm, 0.35);
    EXPECT_DOUBLE_EQ(layers[1].height_mm, 0.15);
    EXPECT_EQ(layers[0].first_byte, 0U);
    EXPECT_EQ(layers[1].first_byte, 18U + 14 + 7 + 12 + 7 + 10);
}

TEST(LayerTracker, APrimingLineBelongsToTheFirstLayer) {
    const auto layers = layers_of(
        "G1 Z.3\nG1 Y100 E10\n;LAYER_COUNT:2\n;LAYER:0\nG1 Z.2\nG1 X10 E1\n;LAYER:1\nG1 Z.4\nG1 X20 E1\n");
    ASSERT_EQ(layers.size(), 2U);
    EXPECT_DOUBLE_EQ(layers[0].z_mm, 0.2);
    EXPECT_DOUBLE_EQ(layers[1].z_mm, 0.4);
    EXPECT_NEAR(layers[1].height_mm, 0.2, 1e-12);
}

TEST(LayerTracker, WithoutCommentsByHeight) {
    const auto layers =
        layers_of("G1 Z.35\nG1 X10 E1\nG1 Z.65\nG1 X20\nG1 Z.35\nG1 X30 E1\nG1 Z.55\nG1 X40 E1\n");
    ASSERT_EQ(layers.size(), 2U) << "a lift without extrusion is no layer";
    EXPECT_NEAR(layers[1].height_mm, 0.2, 1e-12);
}

TEST(LayerTracker, ASpiralByCommentsIsNotCut) {
    std::string program = ";LAYER_CHANGE\n";
    for (int i = 1; i <= 100; ++i)
        program += "G1 X" + std::to_string(i) + " Z" + std::to_string(i * 0.01) + " E.1\n";
    EXPECT_EQ(layers_of(program).size(), 1U);
}

TEST(LayerTracker, ASpiralWithoutCommentsFallsIntoSlices) {
    std::string program;
    for (int i = 1; i <= 100; ++i)
        program += "G1 X" + std::to_string(i) + " Z" + std::to_string(i * 0.01) + " E.1\n";
    const std::size_t layers = layers_of(program).size();
    EXPECT_GE(layers, 20U);
    EXPECT_LE(layers, 26U);
}

TEST(LayerTracker, AJobHasSoManyLayersAndTheRestIsOfTheLast) {
    for (const char* begins : {";LAYER_CHANGE\n", ""}) {
        std::string program;
        for (std::uint32_t i = 0; i < gcode::LayerFinder::kLayersMax + 50; ++i)
            program +=
                begins + ("G1 X" + std::to_string(i % 2 + 1)) + " Z" + std::to_string(i % 3 + 1) + " E.1\n";
        EXPECT_EQ(layers_of(program).size(), gcode::LayerFinder::kLayersMax);
    }
}

TEST(LayerTracker, AnEmptyLayerIsNone) {
    EXPECT_EQ(layers_of(";LAYER:0\nG1 X1 E1\n;LAYER:1\nG1 X5\n;LAYER:2\nG1 X1 E1\n").size(), 2U);
}

TEST(LayerTracker, CommentsSayWhatIsPrinted) {
    LayerTracker tracker;
    gcode::Move move;
    move.kind = gcode::MoveKind::print;
    move.to[Axis::x] = Millimetres{1};
    move.to[Axis::e] = Millimetres{1};
    tracker.on_annotation(gcode::parse_annotation("TYPE:Bridge infill"), {});
    tracker.on_annotation(gcode::parse_annotation("WIDTH:0.4"), {});
    const MoveContext& context = tracker.on_move(move);
    EXPECT_EQ(context.feature, gcode::Feature::bridge);
    EXPECT_EQ(context.width_mm, 0.4);
    EXPECT_TRUE(context.extrudes);
    move.kind = gcode::MoveKind::filament;
    EXPECT_FALSE(tracker.on_move(move).extrudes);
}

}  // namespace
}  // namespace qduino::printer::preflight::layer_tracker_test
