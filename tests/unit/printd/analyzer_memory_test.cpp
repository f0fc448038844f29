// The analyzer's memory does not grow with a file, not even with one that is made for it.
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "analysis/preflight_analyzer.h"
#include "posix/file_bytes.h"
#include "printer/preflight/layer_tracker.h"
#include "tests/unit/printd/heap_peak.h"

namespace qduino::printd::analyzer_memory_test {
namespace {

constexpr std::size_t kAsked = 16'000'000;

/// The `i`-th piece of a job.
using Piece = std::function<std::string(int i)>;

class AnalyzerMemory : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "memory-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    /// The most heap that the analysis of so many bytes needs; its result goes to `analysis_`.
    std::size_t peak_of(std::size_t bytes, const Piece& piece) {
        {
            std::ofstream out{folder_ / "job", std::ios::binary};
            out << "G28\nM109 S215\nM83\nG1 F9000\n";
            for (int i = 0; static_cast<std::size_t>(out.tellp()) < bytes; ++i) out << piece(i);
        }
        analysis_ = {};
        analysis::PreflightAnalyzer analyzer{printer::MachineConfig{}};
        testing::reset_heap_peak();
        const std::size_t before = testing::heap_bytes();
        posix::FileSink layers{folder_ / "layers"};
        auto analysis = analyzer.analyze(*posix::FileBytes::open(folder_ / "job"), layers);
        EXPECT_TRUE(analysis.ok());
        analysis_ = std::move(analysis).value();
        return testing::heap_peak() - before;
    }

    std::filesystem::path folder_;
    spool::Analysis analysis_;
};

TEST_F(AnalyzerMemory, IsBoundedWhateverAFileIsFullOf) {
    const std::pair<const char*, Piece> files[]{
        {"layers", [](int i) { return ";LAYER:1\nG1 X" + std::to_string(i % 2 + 1) + " E1\n"; }},
        {"layers by Z",
         [](int i) {
             return "G1 X" + std::to_string(i % 2 + 1) + "Z" + std::to_string(i % 2 + 1) + " E1\n";
         }},
        {"unknown codes", [](int i) { return "M" + std::to_string(10000 + i % 80000) + " S1\n"; }},
        {"objects", [](int i) { return "EXCLUDE_OBJECT_START NAME=o" + std::to_string(i) + "\n"; }},
        {"one line", [](int) { return "G1 X1 "; }},
        {"thumbnails", [](int i) {
             return i % 1000 == 0
                        ? "; thumbnail begin 9x9 99999999\n"
                        : "; iVBORw0KGgoAAAANSUhEUgAAABAAAAAQCAYAAAAf8/9hAAAAAXNSR0IArs4c6QAAAARn\n";
         }}};
    for (const auto& [name, piece] : files) {
        const std::size_t small = peak_of(6'000'000, piece);
        const std::size_t large = peak_of(12'000'000, piece);
        EXPECT_LE(large, kAsked) << name;
        EXPECT_LE(large, small + 100'000) << name << ": twice as much of it, and not twice the memory";
    }
}

TEST_F(AnalyzerMemory, LayersBeyondTheLastAreOfTheLast) {
    constexpr std::uint32_t kMax = printer::gcode::LayerFinder::kLayersMax;
    static_cast<void>(
        peak_of(1'000'000, [](int i) { return ";LAYER:1\nG1 X" + std::to_string(i % 2 + 1) + " E1\n"; }));
    ASSERT_EQ(analysis_.verdict, spool::Analysis::Verdict::fits) << analysis_.message;
    EXPECT_EQ(nlohmann::json::parse(analysis_.facts_json)["layers"], kMax);
    const auto index = nlohmann::json::parse(analysis_.layers_json);
    ASSERT_EQ(index.size(), kMax);
    EXPECT_EQ(index[kMax - 2]["segments"], 1u);
    EXPECT_GT(index[kMax - 1]["segments"], 20'000u);
}

}  // namespace
}  // namespace qduino::printd::analyzer_memory_test
