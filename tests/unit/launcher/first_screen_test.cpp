// What a person sees first: ten lines of 80 columns at most; the rest is kept, and can be read by
// whoever asks for it.
#include "apps/launcher/first_screen.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "apps/launcher/run_log.h"
#include "apps/launcher/sketch_report.h"
#include "base/parts.h"
#include "board/linux/kernel/run_lock.h"
#include "tests/unit/linux/stranger.h"

namespace qduino::launcher::first_screen_test {
namespace {

namespace fs = std::filesystem;
using test::kStranger;
using test::why_no_stranger;
using ::testing::HasSubstr;
using ::testing::Not;

class FirstScreen : public ::testing::Test {
  protected:
    FirstScreen() { fs::create_directories(folder_); }
    ~FirstScreen() override { fs::remove_all(folder_); }
    [[nodiscard]] std::string text_of(const char* name) const {
        std::ifstream file{folder_ / name};
        return {std::istreambuf_iterator<char>{file}, {}};
    }
    const fs::path folder_ = fs::path{::testing::TempDir()} / ("first-screen-" + std::to_string(::getpid()));
};

ScreenFacts facts() {
    return {.took = 331s,
            .where = "Real time, core 1 is the stepper's.",
            .machine = "Printrbot Simple Metal",
            .address = "http://127.0.0.1:18080/#key=" + std::string(43, 'k'),
            .state = "/var/lib/qduinomc",
            .serial = "",
            .guarantees = "steps yes, heat yes",
            .budget = "web budget 7 of 100 ms (10 asked, 7 fit)"};
}

TEST_F(FirstScreen, IsTenLinesOfEightyColumnsAtMost) {
    const std::string screen = first_screen(facts());
    EXPECT_LE(std::count(screen.begin(), screen.end(), '\n'), 10) << screen;
    std::string_view rest = screen;
    while (!rest.empty()) EXPECT_LE(cut(rest, '\n').size(), 80u) << screen;
    EXPECT_THAT(screen, HasSubstr("Ready in 5 min 31 s. Real time, core 1 is the stepper's.\n"));
    EXPECT_THAT(screen, HasSubstr("Virtual printer: Printrbot Simple Metal\n"));
    EXPECT_THAT(screen, HasSubstr("  Open   " + facts().address + "\n"));
    EXPECT_THAT(screen, HasSubstr("/var/lib/qduinomc/api-key\n"));
    EXPECT_THAT(screen, HasSubstr("  Stop   Ctrl-C\n"));
    EXPECT_THAT(screen,
                HasSubstr("Guarantees: steps yes, heat yes, web budget 7 of 100 ms (10 asked, 7 fit)\n"));
    EXPECT_THAT(screen, HasSubstr("./run --report     Log: /var/lib/qduinomc/run.log\n"));
}

TEST_F(FirstScreen, SaysHowToAskForTheReportOfAnotherFolder) {
    ScreenFacts other = facts();
    other.state = "/tmp/shop";
    other.serial = "/tmp/shop/serial";
    EXPECT_THAT(first_screen(other), HasSubstr("./run --report --state /tmp/shop "));
    EXPECT_THAT(first_screen(other), HasSubstr("  Serial /tmp/shop/serial\n"));
}

TEST_F(FirstScreen, AFolderWithALongNameKeepsToTheScreen) {
    ScreenFacts deep = facts();
    for (const std::size_t length : {30u, 45u, 60u, 66u, 70u}) {
        deep.state = "/" + std::string(length, 'd');
        deep.serial = deep.state / "serial";
        const std::string screen = first_screen(deep);
        std::string_view rest = screen;
        while (!rest.empty()) EXPECT_LE(cut(rest, '\n').size(), 80u) << screen;
        // What is copied stands in one piece.
        EXPECT_THAT(screen, HasSubstr(deep.state.native() + "/api-key\n"));
        EXPECT_THAT(screen, HasSubstr(deep.serial + "\n"));
        EXPECT_THAT(screen, HasSubstr("./run --report"));
        EXPECT_THAT(screen, HasSubstr("run.log"));
    }
}

TEST_F(FirstScreen, TimesAreInMinutes) {
    EXPECT_EQ(minutes_and_seconds(Nanoseconds{1}), "1 s");
    EXPECT_EQ(minutes_and_seconds(59s), "59 s");
    EXPECT_EQ(minutes_and_seconds(600s), "10 min 0 s");
    EXPECT_GT(age_of_this_process(), Nanoseconds{0});
    EXPECT_LT(age_of_this_process(), 3600s);
}

TEST_F(FirstScreen, TheReportIsKeptAndSaysWhetherThePrinterRuns) {
    const auto none = kept_report(folder_);
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.error().code, ErrorCode::not_found);
    std::ofstream{folder_ / "report.txt"} << "What holds\n";
    EXPECT_EQ(kept_report(folder_).value(), "No printer runs there now; the last one's:\nWhat holds\n");
    const auto lock = board::linux::lock_file(folder_ / "run.lock", 0s);
    ASSERT_TRUE(lock.ok());
    EXPECT_EQ(kept_report(folder_).value(), "This printer runs now.\nWhat holds\n");
}

TEST_F(FirstScreen, AReportThatAnotherUserPutThereIsHarmless) {
    // A terminal's command, in one byte and in two, as well as its letters.
    std::ofstream{folder_ / "report.txt"} << "a\x1b[2Jb\xc2\x9b"
                                             "2Jc\x07\n\xc3\xa4\n";
    EXPECT_THAT(kept_report(folder_).value(), HasSubstr("a[2Jb2Jc\n\xc3\xa4\n"));
    fs::remove(folder_ / "report.txt");
    fs::create_symlink("/etc/hostname", folder_ / "report.txt");
    EXPECT_FALSE(kept_report(folder_).ok()) << "a link is not followed";
    fs::remove(folder_ / "report.txt");
    ASSERT_EQ(::mkfifo((folder_ / "report.txt").c_str(), 0600), 0);
    EXPECT_FALSE(kept_report(folder_).ok()) << "and a pipe is not waited for";
}

TEST_F(FirstScreen, TheReportIsOfRootOrOfTheFoldersOwner) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    const fs::path report = folder_ / "report.txt";
    std::ofstream{report} << "What holds\n";
    ASSERT_EQ(::chown(report.c_str(), kStranger, kStranger), 0);
    EXPECT_THAT(std::string{kept_report(folder_).error().message.view()},
                HasSubstr("belongs to another user"));
    ASSERT_EQ(::chown(folder_.c_str(), kStranger, kStranger), 0);
    EXPECT_THAT(kept_report(folder_).value(), HasSubstr("What holds\n"));
    fs::create_hard_link(report, folder_ / "second");
    EXPECT_FALSE(kept_report(folder_).ok()) << "it may be a foreign file";
    fs::remove(folder_ / "second");
    fs::resize_file(report, 1 << 20);
    EXPECT_FALSE(kept_report(folder_).ok()) << "and it takes no memory";
}

TEST_F(FirstScreen, TheSketchsWordsAreTwoLinesAndTheReport) {
    const SketchWords words = read_sketch_words("core\x1b 1\nsteps yes, heat NO\n\nWhat holds\n  1\n");
    EXPECT_EQ(words.where, "core 1");
    EXPECT_EQ(words.guarantees, "steps yes, heat NO");
    EXPECT_EQ(words.rest, "What holds\n  1\n");
    for (const char* broken : {"", "\n", "x", "\n\n\n"})
        EXPECT_EQ(read_sketch_words(broken).rest, "") << broken;
}

TEST_F(FirstScreen, TheSketchsReportIsWrittenThroughItsPathAndForgottenBeforeTheNext) {
    auto report = SketchReport::make();
    ASSERT_TRUE(report.ok());
    std::ofstream{report->path()} << "a\nb\n\nc\n";
    EXPECT_EQ(report->read().rest, "c\n");
    report->clear();
    EXPECT_EQ(report->read().rest, "");
}

TEST_F(FirstScreen, TheLogIsMadeAnewAndThatBeforeIsKept) {
    fs::create_symlink(folder_ / "victim", folder_ / "run.log");
    std::ofstream{folder_ / "victim"} << "untouched";
    {
        const auto log = RunLog::make(folder_);
        ASSERT_TRUE(log.ok()) << log.error().message.view();
        const off_t begin = log->size();
        log->say("the sketch was killed");
        EXPECT_THAT(log->since(begin), HasSubstr(" run: the sketch was killed\n"));
    }
    EXPECT_EQ(text_of("victim"), "untouched");
    ASSERT_TRUE(RunLog::make(folder_).ok());
    EXPECT_THAT(text_of("run.log.1"), HasSubstr("the sketch was killed"));
    EXPECT_EQ(text_of("run.log"), "");
}

TEST_F(FirstScreen, ALogThatGrewKeepsItsEnd) {
    const auto log = RunLog::make(folder_);
    ASSERT_TRUE(log.ok());
    ::testing::internal::CaptureStderr();  // where it is said as well
    for (int i = 0; i < 200; ++i) log->say("line " + std::to_string(i));
    EXPECT_THAT(::testing::internal::GetCapturedStderr(), HasSubstr("run: line 199\n"));
    log->keep_small(1'000'000);
    EXPECT_THAT(text_of("run.log"), HasSubstr("line 0\n"));
    log->keep_small(2000);
    EXPECT_LE(log->size(), 1000);
    EXPECT_THAT(text_of("run.log"), Not(HasSubstr("line 0\n")));
    EXPECT_THAT(text_of("run.log"), HasSubstr("line 199\n"));
    log->say("and it goes on");
    EXPECT_TRUE(text_of("run.log").ends_with("run: and it goes on\n"));
}

}  // namespace
}  // namespace qduino::launcher::first_screen_test
