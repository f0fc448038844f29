#include "qduino/common/sdk.h"

#include <gtest/gtest.h>

#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::sdk_test {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSdk =
    R"({"version": 1, "cxx": "/usr/bin/g++", "cc": "/usr/bin/gcc",
  "prepares_headers": true, "flags": ["-pthread"],
  "include": "../source;/opt/include", "definitions": "", "python": "python3",
  "ino_to_cpp": "/s/ino_to_cpp.py", "unpack_zip": "tools/unpack_zip.py",
  "as_arduino": "../tools/as_arduino.py",
  "supervisor": "bin/qduino-supervisor",
  "sim": {"libraries": ["lib/a.a", "/usr/lib/b.so", "-lm"], "options": [],
          "compiling": ["-fcount"]},
  "linux": {"libraries": [], "options": ["-fsanitize=address"]},
  "metal": {"libraries": ["lib/m.a"], "options": ["-static"], "flags": ["-ffreestanding"],
            "script": "lib/image.ld", "why_not": ""},
  "metal_aarch64": "aarch64/sdk.json"})";
constexpr const char* kAarch64 =
    R"({"libraries": ["libm.a", "-lgcc"], "options": ["-static"], "flags": ["-mcmodel=small"],
        "script": "image.ld", "why_not": "", "cxx": "arm-g++", "cc": "arm-gcc"})";

class SdkTest : public TemporaryFolder {};

TEST_F(SdkTest, PathsMayBeRelativeToTheFile) {
    const Result<Sdk> sdk = read_sdk(write("build/qduino-sdk.json", kSdk));
    ASSERT_TRUE(sdk);
    const std::string here = (folder_ / "build").string();
    EXPECT_EQ(sdk->include, (std::vector<std::string>{(folder_ / "source").string(), "/opt/include"}));
    EXPECT_TRUE(sdk->definitions.empty());
    EXPECT_EQ(sdk->supervisor, here + "/bin/qduino-supervisor");
    EXPECT_EQ(sdk->unpack_zip, here + "/tools/unpack_zip.py");
    EXPECT_EQ(sdk->linking(BoardKind::sim).libraries,
              (std::vector<std::string>{here + "/lib/a.a", "/usr/lib/b.so", "-lm"}));
    EXPECT_EQ(sdk->linking(BoardKind::linux).options, std::vector<std::string>{"-fsanitize=address"});
    EXPECT_EQ(sdk->cxx, std::vector<std::string>{"/usr/bin/g++"});
    EXPECT_EQ(sdk->as_arduino, folder_ / "tools/as_arduino.py");
    EXPECT_TRUE(sdk->prepares_headers);
    EXPECT_TRUE(sdk->compiling.empty());
    EXPECT_EQ(for_simulator(*sdk).compiling, std::vector<std::string>{"-fcount"});
    const Sdk images = for_images(*sdk);
    EXPECT_EQ(images.flags, std::vector<std::string>{"-ffreestanding"});
    EXPECT_EQ(images.linking(BoardKind::metal).libraries, std::vector<std::string>{here + "/lib/m.a"});
    EXPECT_EQ(images.linking(BoardKind::metal).options,
              (std::vector<std::string>{"-static", "-Wl,-T," + here + "/lib/image.ld"}));
}

TEST_F(SdkTest, ImagesForAnotherArchitectureHaveAFileOfTheirOwn) {
    const Result<Sdk> sdk = read_sdk(write("build/qduino-sdk.json", kSdk));
    ASSERT_TRUE(sdk);
    const Result<Sdk> missing = for_aarch64_images(*sdk);
    ASSERT_FALSE(missing);
    EXPECT_NE(missing.error().message.view().find("--target metal-aarch64"), std::string_view::npos);
    write("build/aarch64/sdk.json", kAarch64);
    const Result<Sdk> images = for_aarch64_images(*sdk);
    ASSERT_TRUE(images);
    const std::string here = (folder_ / "build/aarch64").string();
    EXPECT_EQ(images->cxx, std::vector<std::string>{"arm-g++"});
    EXPECT_EQ(images->flags, std::vector<std::string>{"-mcmodel=small"});
    EXPECT_EQ(images->linking(BoardKind::metal).libraries,
              (std::vector<std::string>{here + "/libm.a", "-lgcc"}));
    EXPECT_EQ(images->linking(BoardKind::metal).options,
              (std::vector<std::string>{"-static", "-Wl,-T," + here + "/image.ld"}));
    write("build/aarch64/sdk.json", "{}");
    EXPECT_FALSE(for_aarch64_images(*sdk));
}

TEST_F(SdkTest, AFileThatIsNoneIsNamed) {
    for (const char* text : {"", "{", "[]", "{\"version\": 1}", "{\"version\": 2}"}) {
        const fs::path file = write("sdk.json", text);
        const Result<Sdk> sdk = read_sdk(file);
        ASSERT_FALSE(sdk) << text;
        EXPECT_NE(sdk.error().message.view().find(file.string()), std::string_view::npos) << text;
    }
    EXPECT_FALSE(read_sdk("/nonexistent"));
}

TEST_F(SdkTest, IsFoundByHomeThenBesideTheProgramThenWhereItWasBuilt) {
    const fs::path built = write("first/qduino-sdk.json", ""), beside = write("second/qduino-sdk.json", ""),
                   home = write("tree/build/release/qduino-sdk.json", "");
    SdkPlaces places{.home = (folder_ / "tree").string(),
                     .program = folder_ / "second" / "bin" / "qduino",
                     .built_in = built};
    EXPECT_EQ(find_sdk(places).value(), home);
    places.home = home.string();
    EXPECT_EQ(find_sdk(places).value(), home);
    places.home = home.parent_path().string();
    EXPECT_EQ(find_sdk(places).value(), home);
    places.home = "";
    EXPECT_EQ(find_sdk(places).value(), beside);
    fs::remove(beside);
    EXPECT_EQ(find_sdk(places).value(), built);
    fs::remove(built);
    ASSERT_FALSE(find_sdk(places));
    EXPECT_NE(find_sdk(places).error().message.view().find("set QDUINO_HOME"), std::string_view::npos);
    places.home = (folder_ / "first").string();
    EXPECT_FALSE(find_sdk(places)) << "a wrong QDUINO_HOME is an error, not passed over";
}

TEST(Words, AreParted) {
    EXPECT_EQ(words_of(" ccache  g++ "), (std::vector<std::string>{"ccache", "g++"}));
    EXPECT_TRUE(words_of("").empty());
}

}  // namespace
}  // namespace qduino::apps::sdk_test
