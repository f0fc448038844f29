// Beds by name: saved, loaded, kept beyond the run, and there again at the next start.
#include "printer/machine/bed_profiles.h"

#include <gtest/gtest.h>

namespace qduino::printer::machine::bed_profiles_test {
namespace {

using gcode::BedProfile;

struct Bench {
    MachineConfig config;
    BedProfiles profiles{config};
    motion::Correction correction{config};

    explicit Bench(const MachineConfig& with = {}) : config(with) {}
    void measure(double height) {
        motion::BedMesh mesh{config.mesh};
        mesh.set(1, 2, height);
        mesh.set(4, 4, -height / 3);
        correction.set_mesh(mesh);
    }
    bool does(BedProfile what, std::string_view name) { return profiles.apply(what, name, correction).ok(); }
};

TEST(BedProfiles, AreSavedLoadedAndRemoved) {
    Bench bench;
    EXPECT_FALSE(bench.does(BedProfile::save, "a")) << "nothing has been measured";
    bench.measure(0.2);
    EXPECT_TRUE(bench.does(BedProfile::save, "a"));
    const motion::BedMesh first = bench.correction.mesh();
    bench.measure(0.5);
    EXPECT_TRUE(bench.does(BedProfile::load, "a"));
    EXPECT_EQ(bench.correction.mesh(), first);
    EXPECT_TRUE(bench.does(BedProfile::remove, "a"));
    EXPECT_FALSE(bench.does(BedProfile::load, "a"));
}

TEST(BedProfiles, HaveNamesThatAFileCanHold) {
    Bench bench;
    bench.measure(0.2);
    for (const char* name : {"", "a b", "a\"", "a\nb", "b\xC3\xA4", "a234567890123456789012345678901234"})
        EXPECT_FALSE(bench.does(BedProfile::save, name)) << name;
    EXPECT_TRUE(bench.does(BedProfile::save, "85c_glass-2.0"));
}

TEST(BedProfiles, WhatIsKeptIsThereAtTheNextStartToTheLastBit) {
    Bench bench;
    bench.measure(0.1 + 0.2);
    ASSERT_TRUE(bench.does(BedProfile::save, "a"));
    const motion::BedMesh a = bench.correction.mesh();
    bench.measure(1.0 / 3);
    ASSERT_TRUE(bench.profiles.keep(bench.correction.mesh()).ok());
    MachineConfig next = bench.config;
    next.beds = bench.profiles.kept();
    ASSERT_EQ(next.beds.size(), 2u);
    Bench later{next};
    ASSERT_NE(later.profiles.find("a"), nullptr);
    EXPECT_EQ(*later.profiles.find("a"), a);
    ASSERT_NE(later.profiles.find(kDefaultBed), nullptr) << "a bed without a name";
    EXPECT_EQ(*later.profiles.find(kDefaultBed), bench.correction.mesh());
}

TEST(BedProfiles, ABedThatHasANameIsKeptOnce) {
    Bench bench;
    bench.measure(0.3);
    ASSERT_TRUE(bench.does(BedProfile::save, "a"));
    ASSERT_TRUE(bench.profiles.keep(bench.correction.mesh()).ok());
    EXPECT_EQ(bench.profiles.kept().size(), 1u);
}

TEST(BedProfiles, WhatWasNotKeptIsGoneWhenTheKeptComeBack) {
    Bench bench;
    bench.measure(0.3);
    ASSERT_TRUE(bench.does(BedProfile::save, "a"));
    ASSERT_TRUE(bench.profiles.keep({}).ok());
    ASSERT_TRUE(bench.does(BedProfile::save, "b"));
    ASSERT_TRUE(bench.does(BedProfile::remove, "a"));
    bench.profiles.restore();
    EXPECT_TRUE(bench.does(BedProfile::load, "a"));
    EXPECT_FALSE(bench.does(BedProfile::load, "b"));
}

TEST(BedProfiles, WithoutRoomTheOthersAreKeptAndTheNamelessIsTold) {
    Bench bench;
    for (const char* name : {"a", "b", "c", "d"}) {
        bench.measure(static_cast<double>(name[0]));
        ASSERT_TRUE(bench.does(BedProfile::save, name));
    }
    EXPECT_FALSE(bench.does(BedProfile::save, "e"));
    bench.measure(7);
    EXPECT_FALSE(bench.profiles.keep(bench.correction.mesh()).ok());
    EXPECT_EQ(bench.profiles.kept().size(), kBedProfilesMax);
}

}  // namespace
}  // namespace qduino::printer::machine::bed_profiles_test
