#include "printer/gcode/annotation.h"

#include <gtest/gtest.h>

namespace qduino::printer::gcode::annotation_test {
namespace {

TEST(Annotation, ReadsBothSlicersComments) {
    struct Case {
        const char* comment;
        AnnotationKind kind;
        double value;
        Feature feature;
    };
    const Case cases[] = {
        {"LAYER_CHANGE", AnnotationKind::layer_change, 0, Feature::unknown},
        {"LAYER:17", AnnotationKind::layer_number, 17, Feature::unknown},
        {"Z:0.2", AnnotationKind::z, 0.2, Feature::unknown},
        {"HEIGHT:0.15", AnnotationKind::height, 0.15, Feature::unknown},
        {"WIDTH:0.449999", AnnotationKind::width, 0.449999, Feature::unknown},
        {"TYPE:External perimeter", AnnotationKind::feature, 0, Feature::outer_wall},
        {"TYPE:WALL-OUTER", AnnotationKind::feature, 0, Feature::outer_wall},
        {" TYPE:Custom ", AnnotationKind::feature, 0, Feature::custom},
        {"TYPE:Something new", AnnotationKind::feature, 0, Feature::unknown},
        {"LAYER_COUNT:198", AnnotationKind::none, 0, Feature::unknown},
        {"LAYER:x", AnnotationKind::none, 0, Feature::unknown},
        {"LAYER:-1", AnnotationKind::none, 0, Feature::unknown},
        {"Z:1e9", AnnotationKind::none, 0, Feature::unknown},
        {"WIDTH:99999999", AnnotationKind::none, 0, Feature::unknown},
        {"WIDTH:", AnnotationKind::none, 0, Feature::unknown},
        {" CHANGE_LAYER", AnnotationKind::layer_change, 0, Feature::unknown},
        {" LAYER_HEIGHT: 0.2", AnnotationKind::height, 0.2, Feature::unknown},
        {" FEATURE: Floating vertical shell", AnnotationKind::feature, 0, Feature::solid_infill},
        {" feature gap fill", AnnotationKind::feature, 0, Feature::gap_fill},
        {" layer 12, Z = 0.480", AnnotationKind::layer_change, 0, Feature::unknown},
        {" layer end", AnnotationKind::none, 0, Feature::unknown},
        {" layer_height = 0.2", AnnotationKind::none, 0, Feature::unknown},
        {"layer:0.19", AnnotationKind::layer_change, 0, Feature::unknown},
        {"LAYER_CHANGES = 4", AnnotationKind::none, 0, Feature::unknown},
        {"structure:infill-sparse", AnnotationKind::feature, 0, Feature::sparse_infill},
        {"TYPE:SOLID-FILL", AnnotationKind::feature, 0, Feature::solid_infill},
        {" BEGIN_LAYER_OBJECT z=0.250 z_thickness=0.250", AnnotationKind::layer_change, 0, Feature::unknown},
        {" 'Perimeter Path', 0.0 [feed mm/s]", AnnotationKind::feature, 0, Feature::outer_wall},
        {" 'thinbox.gcode'", AnnotationKind::none, 0, Feature::unknown},
        {"TIME:6666", AnnotationKind::none, 0, Feature::unknown},
        {"", AnnotationKind::none, 0, Feature::unknown},
    };
    for (const Case& c : cases) {
        const Annotation got = parse_annotation(c.comment);
        EXPECT_EQ(got.kind, c.kind) << c.comment;
        EXPECT_EQ(got.value, c.value) << c.comment;
        EXPECT_EQ(got.feature, c.feature) << c.comment;
    }
}

TEST(LayerCounter, CountsEitherWayAndNotBoth) {
    LayerCounter cura;
    for (const char* comment : {"LAYER_COUNT:3", "LAYER:0", "LAYER:1", "TYPE:FILL", "LAYER:2"}) {
        cura.on_annotation(parse_annotation(comment));
    }
    EXPECT_EQ(cura.layers(), 3U);
    LayerCounter both;
    EXPECT_TRUE(both.on_annotation(parse_annotation("LAYER_CHANGE")));
    EXPECT_FALSE(both.on_annotation(parse_annotation("LAYER:0")));
    EXPECT_TRUE(both.on_annotation(parse_annotation("LAYER_CHANGE")));
    EXPECT_EQ(both.layers(), 2U);
}

}  // namespace
}  // namespace qduino::printer::gcode::annotation_test
