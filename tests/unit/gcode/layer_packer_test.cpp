// The packed format is read back here as the page reads it: from the description in layer_packer.h,
// byte by byte.
#include "printer/preflight/layer_packer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "printer/preflight/preflight.h"

namespace qduino::printer::preflight::layer_packer_test {
namespace {

template <typename T>
T at(const std::vector<std::uint8_t>& bytes, std::size_t offset) {
    T value;  // the machines that run these tests are little-endian
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

struct Vertex {
    float x, y, z;
    std::uint8_t feature, flags;
    std::uint16_t width_um;
    std::uint32_t byte;
};

struct Unpacked {
    std::uint32_t layer, part;
    float z_mm, height_mm;
    std::uint32_t segments;
    double first_byte;
    std::vector<Vertex> vertices;
};

class Collector : public LayerSink {
  public:
    void on_layer(const LayerRecord& record, std::span<const std::uint8_t> span) override {
        const std::vector<std::uint8_t> bytes(span.begin(), span.end());
        ASSERT_GE(bytes.size(), kLayerHeaderBytes);
        ASSERT_EQ(std::memcmp(bytes.data(), "QDL1", 4), 0);
        Unpacked out{at<std::uint32_t>(bytes, 4),
                     at<std::uint32_t>(bytes, 8),
                     at<float>(bytes, 12),
                     at<float>(bytes, 16),
                     at<std::uint32_t>(bytes, 24),
                     at<double>(bytes, 32),
                     {}};
        const auto count = at<std::uint32_t>(bytes, 20);
        ASSERT_EQ(bytes.size(), kLayerHeaderBytes + count * kVertexBytes);
        std::uint32_t segments = 0;
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t v = kLayerHeaderBytes + i * kVertexBytes;
            out.vertices.push_back({at<float>(bytes, v), at<float>(bytes, v + 4), at<float>(bytes, v + 8),
                                    bytes[v + 12], bytes[v + 13], at<std::uint16_t>(bytes, v + 14),
                                    at<std::uint32_t>(bytes, v + 16)});
            segments += out.vertices.back().flags == 0 ? 1 : 0;
        }
        EXPECT_EQ(segments, out.segments);
        EXPECT_EQ(record.segments, out.segments);
        EXPECT_EQ(record.vertices, count);
        EXPECT_EQ(record.layer.index, out.layer);
        layers.push_back(out);
    }
    std::vector<Unpacked> layers;
};

std::vector<Unpacked> pack(const std::string& program) {
    Preflight preflight{MachineConfig{}};
    Collector collector;
    LayerPacker packer{1.75, collector};
    preflight.add_sink(packer);
    preflight.feed(std::span<const char>{program.data(), program.size()});
    (void)preflight.finish();
    return collector.layers;
}

TEST(LayerPacker, ASquareAndAGap) {
    const std::string program =
        "G28\nM109 S200\nM83\n;LAYER_CHANGE\n;HEIGHT:0.2\n;TYPE:External perimeter\n;WIDTH:0.45\n"
        "G1 X10 Y10 Z.2 F6000\nG1 X20 E1\nG1 Y20 E1\nG1 X50\nG1 Y30 E1\n"
        ";LAYER_CHANGE\nG1 Z.4\n;TYPE:Internal infill\nG1 X60 E1\n";
    const auto layers = pack(program);
    ASSERT_EQ(layers.size(), 2U);
    const Unpacked& first = layers[0];
    EXPECT_EQ(first.layer, 0U);
    EXPECT_EQ(first.part, 0U);
    EXPECT_FLOAT_EQ(first.z_mm, 0.2F);
    EXPECT_FLOAT_EQ(first.height_mm, 0.2F);
    ASSERT_EQ(first.vertices.size(), 5U);
    const float xs[] = {10, 20, 20, 50, 50};
    const float ys[] = {10, 10, 20, 20, 30};
    const std::uint8_t flags[] = {1, 0, 0, 1, 0};
    for (std::size_t i = 0; i < 5; ++i) {
        EXPECT_FLOAT_EQ(first.vertices[i].x, xs[i]);
        EXPECT_FLOAT_EQ(first.vertices[i].y, ys[i]);
        EXPECT_FLOAT_EQ(first.vertices[i].z, 0.2F);
        EXPECT_EQ(first.vertices[i].flags, flags[i]);
        EXPECT_EQ(first.vertices[i].feature, static_cast<std::uint8_t>(gcode::Feature::outer_wall));
    }
    EXPECT_EQ(first.vertices[1].width_um, 450);
    EXPECT_EQ(first.vertices[1].byte, program.find("G1 X20"));
    EXPECT_EQ(first.vertices[4].byte, program.find("G1 Y30"));

    const Unpacked& second = layers[1];
    EXPECT_EQ(second.layer, 1U);
    EXPECT_EQ(second.first_byte, static_cast<double>(program.rfind(";LAYER_CHANGE")));
    ASSERT_EQ(second.vertices.size(), 2U);
    EXPECT_EQ(second.vertices[1].feature, static_cast<std::uint8_t>(gcode::Feature::sparse_infill));
    EXPECT_EQ(second.first_byte + second.vertices[1].byte, static_cast<double>(program.find("G1 X60")));
}

TEST(LayerPacker, TheWidthComesFromTheFilamentWhereNoCommentSaysIt) {
    const auto layers = pack("G28\nM109 S200\nM83\nG1 Z.2\nG1 X100 E5\n");
    ASSERT_EQ(layers.size(), 1U);
    // π/4 · 1.75² · 5 / (0.2 · 100) = 0.601 mm
    EXPECT_EQ(layers[0].vertices[1].width_um, 601);
}

TEST(LayerPacker, NothingExtrudedIsNothingPacked) {
    EXPECT_TRUE(pack("G28\nG1 X10\nG1 Y10\n").empty());
    EXPECT_TRUE(pack("").empty());
}

TEST(LayerPacker, AnEndlessLayerIsDividedAndLosesNothing) {
    Collector collector;
    LayerPacker packer{1.75, collector};
    MoveContext context;
    context.extrudes = true;
    const std::size_t count = kVerticesMax + 1000;
    gcode::Move move;
    for (std::size_t i = 0; i < count; ++i) {
        move.from = move.to;
        move.to[Axis::x] = Millimetres{static_cast<double>(i % 100) + 1};
        packer.on_move(move, context);
    }
    packer.on_end(0);
    ASSERT_EQ(collector.layers.size(), 2U);
    EXPECT_EQ(collector.layers[0].part, 0U);
    EXPECT_EQ(collector.layers[1].part, 1U);
    EXPECT_EQ(collector.layers[0].layer, collector.layers[1].layer);
    EXPECT_EQ(collector.layers[0].segments + collector.layers[1].segments, count);
    EXPECT_EQ(collector.layers[1].vertices[0].flags, kVertexStartsPolyline);
    EXPECT_EQ(collector.layers[1].vertices[0].x, collector.layers[0].vertices.back().x);
}

}  // namespace
}  // namespace qduino::printer::preflight::layer_packer_test
