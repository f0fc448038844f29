// Beds by name: saved, loaded, kept beyond the run, and there again at the next start.
#include "printer/machine/bed_profiles.h"

#include <gtest/gtest.h>

#include <algorithm>

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

/// The machine of the next start, with what M500 has kept.
Bench next_start(const Bench& bench) {
    MachineConfig next = bench.config;
    next.beds = bench.profiles.kept();
    return Bench{next};
}

TEST(BedProfiles, WhatIsKeptIsThereAtTheNextStartToTheLastBit) {
    Bench bench;
    bench.measure(0.1 + 0.2);
    ASSERT_TRUE(bench.does(BedProfile::save, "a"));
    const motion::BedMesh a = bench.correction.mesh();
    bench.measure(1.0 / 3);
    ASSERT_TRUE(bench.profiles.keep(bench.correction.mesh()).ok());
    Bench later = next_start(bench);
    EXPECT_EQ(later.profiles.kept_in_force(), bench.correction.mesh()) << "a bed without a name";
    ASSERT_TRUE(later.does(BedProfile::load, "a"));
    EXPECT_EQ(later.correction.mesh(), a);
    ASSERT_TRUE(later.does(BedProfile::load, kDefaultBed));
    EXPECT_EQ(later.correction.mesh(), bench.correction.mesh());
}

TEST(BedProfiles, ABedInForceByItsNameIsTheOneOfTheNextStart) {
    Bench bench;
    bench.measure(0.5);
    ASSERT_TRUE(bench.profiles.keep(bench.correction.mesh()).ok()) << "a default of an earlier M500";
    bench.measure(0.3);
    ASSERT_TRUE(bench.does(BedProfile::save, "a"));
    ASSERT_TRUE(bench.does(BedProfile::save, "same"));
    ASSERT_TRUE(bench.does(BedProfile::load, "a"));
    ASSERT_TRUE(bench.profiles.keep(bench.correction.mesh()).ok());
    EXPECT_EQ(bench.profiles.kept().size(), 3u) << "and not once more, without a name";
    EXPECT_EQ(std::ranges::count(bench.profiles.kept(), true, &KeptBed::in_force), 1);
    EXPECT_EQ(next_start(bench).profiles.kept_in_force(), bench.correction.mesh());
    // With none in force (BED_MESH_CLEAR), none is there, whatever the profiles.
    ASSERT_TRUE(bench.profiles.keep({}).ok());
    EXPECT_EQ(bench.profiles.kept().size(), 3u);
    EXPECT_FALSE(next_start(bench).profiles.kept_in_force().known());
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
