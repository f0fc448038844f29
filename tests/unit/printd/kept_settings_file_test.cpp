// What M500 keeps comes from the sketch, is whole on disk, and is never nonsense.
#include "apps/printd/kept_settings_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>
#include <memory>

#include "config/machine_file.h"
#include "posix/small_file.h"

namespace qduino::printd::kept_settings_file_test {
namespace {

class KeptSettingsFileTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "kept-settings-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        link_->session = 7;
        kept_.hot_end = settings_of(machine_.hot_end);
        kept_.bed = settings_of(machine_.bed);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    /// The sketch's M500.
    void keep(double kp) {
        ++kept_.number;
        kept_.hot_end.kp = kp;
        link_->kept_heat.write(kept_);
    }
    double kp_on_file() {
        const auto read = apps::read_machine_files("", folder_ / "kept-settings.toml");
        return read ? read->hot_end.kp : -1;
    }

    printer::KeptBeds beds_on_file() {
        const auto read = apps::read_machine_files("", folder_ / "kept-settings.toml");
        return read ? read->beds : printer::KeptBeds{};
    }

    std::filesystem::path folder_;
    printer::MachineConfig machine_;
    printer::link::KeptHeat kept_;
    std::unique_ptr<printer::link::LinkLayout> link_ = std::make_unique<printer::link::LinkLayout>();
};

TEST_F(KeptSettingsFileTest, EachM500IsKeptOnceAndCountsAtTheNextStart) {
    KeptSettingsFile file{folder_};
    EXPECT_FALSE(file.take(nullptr));
    EXPECT_FALSE(file.take(link_.get())) << "nothing was kept yet";
    EXPECT_EQ(kp_on_file(), machine_.hot_end.kp);
    keep(31.5);
    EXPECT_TRUE(file.take(link_.get()));
    EXPECT_FALSE(file.take(link_.get())) << "no news";
    EXPECT_EQ(kp_on_file(), 31.5);
    keep(17.25);
    EXPECT_TRUE(file.take(link_.get()));
    EXPECT_EQ(kp_on_file(), 17.25);
}

TEST_F(KeptSettingsFileTest, AServiceThatComesBackKeepsTheSameAgain) {
    keep(31.5);
    EXPECT_TRUE(KeptSettingsFile{folder_}.take(link_.get()));
    EXPECT_TRUE(KeptSettingsFile{folder_}.take(link_.get())) << "it cannot know: the same numbers do no harm";
    EXPECT_EQ(kp_on_file(), 31.5);
}

TEST_F(KeptSettingsFileTest, NonsenseOnTheLinkDoesNotReachTheFile) {
    KeptSettingsFile file{folder_};
    keep(31.5);
    ASSERT_TRUE(file.take(link_.get()));
    for (const double bad : {-1.0, 1e9, std::numeric_limits<double>::quiet_NaN()}) {
        keep(bad);
        EXPECT_FALSE(file.take(link_.get())) << bad;
        EXPECT_EQ(kp_on_file(), 31.5);
    }
    kept_.hot_end.model.loss_w_k = 0;
    keep(5);
    EXPECT_FALSE(file.take(link_.get())) << "a heater without loss would divide by 0";
}

printer::KeptBed some_bed(const char* name) {
    printer::KeptBed bed{.name = name,
                         .minimum = {Millimetres{20}, Millimetres{-25.5}},
                         .maximum = {Millimetres{130}, Millimetres{118}},
                         .points = {3, 4}};
    for (std::size_t row = 0; row < 4; ++row)
        for (std::size_t column = 0; column < 3; ++column)
            bed.heights[row][column] = 0.1 * static_cast<double>(row) - static_cast<double>(column) / 3;
    return bed;
}

TEST_F(KeptSettingsFileTest, BedsComeBackToTheLastBit) {
    KeptSettingsFile file{folder_};
    printer::KeptBeds beds;
    beds.push_back(some_bed("default"));
    beds.push_back(some_bed("85c_glass-2.0"));
    beds.back().in_force = true;
    link_->kept_beds.write(beds);
    keep(12);
    ASSERT_TRUE(file.take(link_.get()));
    const printer::KeptBeds read = beds_on_file();
    ASSERT_EQ(read.size(), 2u);
    for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_EQ(read[i].name, beds[i].name.view());
        EXPECT_EQ(read[i].in_force, beds[i].in_force);
        EXPECT_EQ(read[i].minimum, beds[i].minimum);
        EXPECT_EQ(read[i].maximum, beds[i].maximum);
        EXPECT_EQ(read[i].points, beds[i].points);
        EXPECT_EQ(read[i].heights, beds[i].heights);
    }
    EXPECT_EQ(kp_on_file(), 12);
}

TEST_F(KeptSettingsFileTest, ABedThatIsNoneDoesNotReachTheFile) {
    KeptSettingsFile file{folder_};
    const auto refused = [&](auto&& spoil) {
        printer::KeptBed bed = some_bed("a");
        spoil(bed);
        printer::KeptBeds beds;
        beds.push_back(bed);
        link_->kept_beds.write(beds);
        keep(12);
        return !file.take(link_.get()) && beds_on_file().empty();
    };
    EXPECT_TRUE(refused([](auto& bed) { bed.points = {16, 4}; }));
    EXPECT_TRUE(refused([](auto& bed) { bed.points = {1, 4}; }));
    EXPECT_TRUE(refused([](auto& bed) { bed.heights[1][1] = std::numeric_limits<double>::quiet_NaN(); }));
    EXPECT_TRUE(refused([](auto& bed) { bed.heights[3][2] = 1e6; }));
    EXPECT_TRUE(refused([](auto& bed) { bed.maximum = bed.minimum; }));
    EXPECT_TRUE(refused([](auto& bed) { bed.name = "a\"\n[bed]\nkp = 1\n"; }));
    EXPECT_FALSE(refused([](auto&) {}));
}

}  // namespace
}  // namespace qduino::printd::kept_settings_file_test
