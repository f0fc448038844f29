// A spool in a folder of its own, with a link in plain memory and the stand-in sketch at its other
// end, stepped by hand.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "spool/disk/disk_storage.h"
#include "spool/spool.h"
#include "tests/e2e/service/fake_sketch.h"

namespace qduino::spool {

/// The link that a test swaps at will.
class TestLink final : public LinkSource {
  public:
    printer::link::LinkLayout* current() override { return current_; }
    bool is_replaced() override { return current_ != newest_; }
    void reopen() override { current_ = newest_; }
    void set(printer::link::LinkLayout* newest) { newest_ = newest; }

  private:
    printer::link::LinkLayout* current_ = nullptr;
    printer::link::LinkLayout* newest_ = nullptr;
};

/// What a sketch did with each run.
struct Printed {
    std::map<std::uint64_t, std::string> bytes;
    std::map<std::uint64_t, printer::link::JobOutcome> outcomes;
    std::vector<std::string> gcode;

    [[nodiscard]] tests::FakeSketch::Log log() {
        return {
            [this](std::uint64_t job, std::uint64_t) {
                EXPECT_TRUE(bytes.emplace(job, "").second) << "begun twice";
            },
            [this](std::uint64_t job, std::span<const std::uint8_t> taken) {
                bytes[job].append(taken.begin(), taken.end());
            },
            [this](std::uint64_t job, printer::link::JobOutcome outcome) {
                EXPECT_TRUE(outcomes.emplace(job, outcome).second) << "ended twice";
            },
            [this](const std::string& line) { gcode.push_back(line); },
        };
    }
};

class SpoolTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "spool-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
        disk_.folder = folder_ / "state";
        disk_.limits.free_space_min_bytes = 0;
        options_.calendar_from_s = 0;
        options_.confirm_bed = false;  // its own tests switch it on
    }
    void TearDown() override {
        spool_.reset();
        std::filesystem::remove_all(folder_);
    }

    /// Null: the one in disk_.folder.
    virtual std::unique_ptr<Storage> make_storage() { return nullptr; }
    Result<std::unique_ptr<Spool>> opened_spool(Inspector* inspector) {
        std::unique_ptr<Storage> storage = make_storage();
        if (!storage) {
            QDUINO_TRY_ASSIGN(storage, DiskStorage::open(disk_));
        }
        return Spool::open(options_, std::move(storage), *link_, inspector);
    }
    BlobStore& blobs() { return static_cast<BlobStore&>(spool_->files()); }
    void open_spool() {
        spool_.reset();
        link_ = std::make_unique<TestLink>();
        link_->set(layout_.get());
        auto opened = opened_spool(inspector_);
        ASSERT_TRUE(opened.ok()) << opened.error().message.view();
        spool_ = std::move(*opened);
    }
    void start_sketch() {
        ++session_;
        sketch_.reset();
        old_layouts_.push_back(std::move(layout_));
        layout_ = std::make_unique<printer::link::LinkLayout>();
        layout_->session = session_;
        sketch_ = std::make_unique<tests::FakeSketch>(*layout_, printed_[session_].log());
        if (link_) link_->set(layout_.get());
    }
    /// `rounds` of 20 ms: the spool ticks, the sketch takes up to `bytes` job bytes.
    void run(int rounds, std::size_t bytes = 1 << 20) {
        for (int i = 0; i < rounds; ++i) {
            now_ += std::chrono::milliseconds{20};
            if (spool_) spool_->tick(now_, 1000 + to_ns(now_) / 1'000'000'000);
            if (sketch_) sketch_->step(bytes);
        }
    }
    Result<JobId> add(const std::string& content, NewJob wanted = {}) {
        if (wanted.name.empty()) wanted.name = "test.gcode";
        auto staged = spool_->files().stage();
        EXPECT_TRUE(staged.ok());
        EXPECT_TRUE((*staged)->write(content).ok());
        EXPECT_TRUE((*staged)->seal().ok());
        return spool_->add(**staged, {}, wanted, 1000);
    }
    JobState state(JobId id) { return spool_->find(id)->state; }
    Printed& printed() { return printed_[session_]; }

    std::filesystem::path folder_;
    DiskOptions disk_;
    SpoolOptions options_;
    Inspector* inspector_ = nullptr;
    std::unique_ptr<TestLink> link_;
    std::unique_ptr<printer::link::LinkLayout> layout_;
    std::vector<std::unique_ptr<printer::link::LinkLayout>> old_layouts_;
    std::unique_ptr<tests::FakeSketch> sketch_;
    std::unique_ptr<Spool> spool_;
    std::map<std::uint64_t, Printed> printed_;  // by session
    std::uint64_t session_ = 0;
    Instant now_ = instant_from_ns(1'000'000'000);
};

inline std::string content_of(std::size_t size, unsigned seed) {
    std::string content;
    for (; content.size() < size; ++seed) {
        content += "G1 X" + std::to_string(seed % 150) + " Y" + std::to_string(seed) + "\n";
    }
    content.resize(size);
    return content;
}

}  // namespace qduino::spool
