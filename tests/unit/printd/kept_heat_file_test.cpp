// What M500 keeps comes from the sketch, is whole on disk, and is never nonsense.
#include "apps/printd/kept_heat_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <limits>
#include <memory>

#include "apps/machine_file/machine_file.h"
#include "posix/small_file.h"

namespace qduino::printd::kept_heat_file_test {
namespace {

class KeptHeatFileTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "kept-heat-XXXXXX").string();
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

    std::filesystem::path folder_;
    printer::MachineConfig machine_;
    printer::link::KeptHeat kept_;
    std::unique_ptr<printer::link::LinkLayout> link_ = std::make_unique<printer::link::LinkLayout>();
};

TEST_F(KeptHeatFileTest, EachM500IsKeptOnceAndCountsAtTheNextStart) {
    KeptHeatFile file{folder_};
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

TEST_F(KeptHeatFileTest, AServiceThatComesBackKeepsTheSameAgain) {
    keep(31.5);
    EXPECT_TRUE(KeptHeatFile{folder_}.take(link_.get()));
    EXPECT_TRUE(KeptHeatFile{folder_}.take(link_.get())) << "it cannot know: the same numbers do no harm";
    EXPECT_EQ(kp_on_file(), 31.5);
}

TEST_F(KeptHeatFileTest, NonsenseOnTheLinkDoesNotReachTheFile) {
    KeptHeatFile file{folder_};
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

}  // namespace
}  // namespace qduino::printd::kept_heat_file_test
