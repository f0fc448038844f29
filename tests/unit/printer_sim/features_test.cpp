#include "apps/printer_sim/features.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace qduino::apps::features_test {
namespace {

TEST(Features, AreReadInTheWordsOfEachSlicer) {
    EXPECT_EQ(feature_of(";TYPE:External perimeter\r"), "External perimeter");
    EXPECT_EQ(feature_of("; FEATURE: Outer wall"), "Outer wall");
    EXPECT_EQ(feature_of("; feature solid layer"), "solid layer");
    EXPECT_EQ(feature_of("G1 X1 ;TYPE:no"), std::nullopt);
    EXPECT_EQ(feature_of(";TYPE:"), "");
    EXPECT_EQ(feature_of("; features"), std::nullopt);
}

TEST(Features, TimeIsAddedUpOverTheLinesBetweenTwoComments) {
    const auto path = std::filesystem::temp_directory_path() / ("features-" + std::to_string(::getpid()));
    std::ofstream(path) << "G28\n;TYPE:Wall\nG1 X1\nG1 X2\n;TYPE:Infill\nG1 X3\n;TYPE:Wall\nG1 X4\n";
    // By line, from 1; of line 4 nothing was moved.
    const auto times = time_by_feature(path, {0, 0.5f, 0, 2, 0, 0, 3, 0, 4});
    std::filesystem::remove(path);
    ASSERT_EQ(times.size(), 3u);
    EXPECT_EQ(times[0].name, "Wall");
    EXPECT_DOUBLE_EQ(times[0].seconds, 6);
    EXPECT_EQ(times[1].name, "Infill");
    EXPECT_DOUBLE_EQ(times[1].seconds, 3);
    EXPECT_EQ(times[2].name, "");
    EXPECT_DOUBLE_EQ(times[2].seconds, 0.5);
}

TEST(Features, AFileThatIsGoneHasNoneButTheTimeIsKept) {
    const auto times = time_by_feature("/nonexistent", {1.5f});
    ASSERT_EQ(times.size(), 1u);
    EXPECT_DOUBLE_EQ(times[0].seconds, 1.5);
}

}  // namespace
}  // namespace qduino::apps::features_test
