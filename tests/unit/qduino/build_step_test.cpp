#include "qduino/common/build_step.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "qduino/common/child_process.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::build_step_test {
namespace {

namespace fs = std::filesystem;
using Paths = std::vector<fs::path>;

TEST(Depfile, NamesWhatTheCompilerRead) {
    EXPECT_EQ(dependencies_in("a.o: a.cpp b.h\n"), (Paths{"a.cpp", "b.h"}));
    EXPECT_EQ(dependencies_in("/x/a.o: a.cpp \\\n  b.h \\\n c.h\n"), (Paths{"a.cpp", "b.h", "c.h"}));
    EXPECT_EQ(dependencies_in("a.o: my\\ sketch/a.cpp x\\#y.h c$$d.h\n"),
              (Paths{"my sketch/a.cpp", "x#y.h", "c$d.h"}));
    EXPECT_EQ(dependencies_in("a.o: a.cpp\nb.h:\n"), Paths{"a.cpp"});
    EXPECT_EQ(dependencies_in(""), Paths{});
    EXPECT_EQ(dependencies_in("no target here"), Paths{});
}

TEST(Colours, AreLeftOut) {
    EXPECT_EQ(without_colours("\033[01m\033[Ka.ino:3:\033[m\033[K x"), "a.ino:3: x");
    EXPECT_EQ(without_colours("plain [text]\n"), "plain [text]\n");
    EXPECT_EQ(without_colours("cut \033["), "cut ");
}

TEST(ShellWords, ReadAsTheyWereGiven) {
    EXPECT_EQ(shell_words({"g++", "-DX=1", "my sketch/a.cpp", "it's", ""}),
              "g++ -DX=1 'my sketch/a.cpp' 'it'\\''s' ''");
}

class BuildStepTest : public TemporaryFolder {
  protected:
    /// Copies in.txt to out.txt, and writes a line for each of its runs.
    BuildStep copy_step() {
        const fs::path in = folder_ / "in.txt", out = folder_ / "out" / "out.txt";
        return {.title = "Copying",
                .command = {"sh", "-c", "cp \"$0\" \"$1\" && echo run >>\"$2\" && echo said", in, out,
                            folder_ / "runs"},
                .inputs = {in},
                .output = out,
                .depfile = {}};
    }
    int runs() {
        const std::string text = read(folder_ / "runs");
        return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
    }
    static StepsDone done(const std::vector<BuildStep>& steps) {
        const Result<StepsDone> result = run_steps(steps, false);
        EXPECT_TRUE(result);
        return result ? *result : StepsDone{};
    }
    /// As if it had been saved `by` later than it was.
    static void touch(const fs::path& path, std::chrono::seconds by) {
        fs::last_write_time(path, fs::last_write_time(path) + by);
    }
};

TEST_F(BuildStepTest, IsMadeOnceAndAgainWhenAnInputIsNewer) {
    const fs::path in = write("in.txt", "one");
    touch(in, std::chrono::seconds(-10));
    const BuildStep step = copy_step();
    EXPECT_FALSE(is_up_to_date(step));
    EXPECT_EQ(done({step}).made, 1);
    EXPECT_TRUE(is_up_to_date(step));
    EXPECT_EQ(done({step}).made, 0);
    EXPECT_EQ(runs(), 1);
    EXPECT_EQ(read(folder_ / "out/out.txt.log"), "said\n");

    write("in.txt", "two");
    EXPECT_FALSE(is_up_to_date(step));
    EXPECT_EQ(done({step}).made, 1);
    EXPECT_EQ(read(step.output), "two");
}

TEST_F(BuildStepTest, AnotherCommandOrAnotherInputMakesItAgain) {
    touch(write("in.txt", "one"), std::chrono::seconds(-10));
    BuildStep step = copy_step();
    done({step});
    BuildStep other = step;
    other.command.push_back("more");
    EXPECT_FALSE(is_up_to_date(other));
    other = step;
    other.inputs.push_back(write("second.txt", ""));
    touch(other.inputs[1], std::chrono::seconds(-10));
    EXPECT_FALSE(is_up_to_date(other));
    EXPECT_TRUE(is_up_to_date(step));
}

TEST_F(BuildStepTest, WhatTheDepfileNamesCountsToo) {
    touch(write("in.txt", "one"), std::chrono::seconds(-10));
    const fs::path header = write("header.h", "");
    touch(header, std::chrono::seconds(-10));
    BuildStep step = copy_step();
    step.depfile = write("out.d", "out.txt: " + header.string() + "\n");
    done({step});
    EXPECT_TRUE(is_up_to_date(step));
    touch(header, std::chrono::seconds(3600));
    EXPECT_FALSE(is_up_to_date(step));
    touch(header, std::chrono::seconds(-3600));
    EXPECT_TRUE(is_up_to_date(step));
    fs::remove(header);
    EXPECT_FALSE(is_up_to_date(step));
    fs::remove(step.depfile);
    EXPECT_FALSE(is_up_to_date(step));
}

TEST_F(BuildStepTest, AFailureLeavesNothingThatLooksMade) {
    touch(write("in.txt", "one"), std::chrono::seconds(-10));
    BuildStep step = copy_step();
    step.command[2] = "cp \"$0\" \"$1\"; echo wrong >&2; exit 3";
    const StepsDone failed = done({step});
    EXPECT_TRUE(failed.failed);
    EXPECT_FALSE(is_up_to_date(step));
    EXPECT_EQ(read(folder_ / "out/out.txt.log").find("wrong"), 0u);
}

TEST_F(BuildStepTest, AToolThatIsNotThereIsNamed) {
    write("in.txt", "");
    BuildStep step = copy_step();
    step.command = {"/nonexistent/compiler"};
    const Result<StepsDone> result = run_steps({step}, false);
    ASSERT_FALSE(result);
    EXPECT_NE(result.error().message.view().find("/nonexistent/compiler"), std::string_view::npos);
}

TEST_F(BuildStepTest, ManyStepsAreAllMade) {
    touch(write("in.txt", "one"), std::chrono::seconds(-10));
    std::vector<BuildStep> steps;
    for (int i = 0; i < 20; ++i) {
        BuildStep step = copy_step();
        step.output = folder_ / ("out" + std::to_string(i));
        step.command[4] = step.output;
        steps.push_back(step);
    }
    EXPECT_EQ(done(steps).made, 20);
    for (const BuildStep& step : steps) EXPECT_EQ(read(step.output), "one");
    EXPECT_EQ(done(steps).made, 0);
}

}  // namespace
}  // namespace qduino::apps::build_step_test
