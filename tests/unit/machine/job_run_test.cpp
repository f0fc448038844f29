#include "printer/machine/job_run.h"

#include <gtest/gtest.h>

#include <memory>

#include "tests/unit/gcode/recorder.h"

namespace qduino::printer::machine::job_run_test {
namespace {

using link::JobOutcome;
using Read = JobRun::Read;

struct Bench {
    MachineConfig config;
    std::unique_ptr<link::LinkLayout> layout = std::make_unique<link::LinkLayout>();
    LinkEnd link{*layout};
    std::unique_ptr<Places> places = std::make_unique<Places>();
    gcode::Recorder recorder;
    std::unique_ptr<JobRun> job = std::make_unique<JobRun>(config, recorder, link, *places);

    void send(std::string_view text, std::uint64_t id = 1) {
        const auto* bytes = reinterpret_cast<const std::uint8_t*>(text.data());
        ASSERT_TRUE(link::try_push(layout->jobs, link::encode(link::JobBegin{id, text.size()})));
        ASSERT_TRUE(
            link::try_push(layout->jobs, link::encode(link::JobBytes{id, 0, std::span{bytes, text.size()}})));
        ASSERT_TRUE(link::try_push(layout->jobs, link::encode(link::JobEnd{id})));
    }
    /// Until nothing is there, or a line fails; the error's text.
    std::string read_all() {
        while (true) {
            const Result<Read> read = job->read();
            if (!read.ok()) return std::string{read.error().message.view()};
            if (*read == Read::nothing) return "";
        }
    }
};

TEST(JobRun, ReadsItsLinesInOrderAndThenIsRead) {
    Bench bench;
    EXPECT_EQ(*bench.job->read(), Read::nothing);
    bench.send("M106 S255\nG4 S2\nM107");
    EXPECT_EQ(*bench.job->read(), Read::begun);
    EXPECT_TRUE(bench.job->running());
    EXPECT_FALSE(bench.job->read_to_end());
    EXPECT_EQ(bench.read_all(), "");
    EXPECT_TRUE(bench.job->read_to_end());
    EXPECT_EQ(bench.recorder.log, (std::vector<std::string>{"fan 0 1", "dwell 2", "fan 0 0"}))
        << "the last line has no end";
    EXPECT_EQ(bench.link.status().job_length, 20u);
    EXPECT_EQ(bench.link.status().outcome, JobOutcome::running);
}

TEST(JobRun, ALineThatFailsSaysWhichAndWhy) {
    for (const char* line : {"G1 X999", "G1 X1.2.3", "M104 S9999"}) {
        Bench bench;
        bench.send("M107\n" + std::string(line) + "\nM106\n");
        EXPECT_NE(bench.read_all().find("line 2"), std::string::npos) << line;
        EXPECT_EQ(bench.recorder.log, (std::vector<std::string>{"fan 0 0"})) << "nothing behind it was done";
    }
}

TEST(JobRun, EndsOnceWithItsOutcome) {
    Bench bench;
    bench.send("M107\n");
    bench.read_all();
    bench.job->end({JobOutcome::failed, FixedString<236>{"because"}});
    EXPECT_FALSE(bench.job->running());
    EXPECT_FALSE(bench.job->read_to_end());
    EXPECT_EQ(bench.link.status().outcome, JobOutcome::failed);
    EXPECT_EQ(bench.link.status().fault.view(), "because");
    bench.job->end({JobOutcome::cancelled, FixedString<236>{"again"}});
    EXPECT_EQ(bench.link.status().outcome, JobOutcome::failed) << "no job runs any more";
    EXPECT_EQ(bench.link.status().fault.view(), "because");
}

TEST(JobRun, ACompletedJobKeepsItsModesAndOthersDoNot) {
    for (const JobOutcome outcome : {JobOutcome::completed, JobOutcome::cancelled}) {
        Bench bench;
        bench.send("G91\n");
        bench.read_all();
        bench.job->end({outcome});
        EXPECT_EQ(bench.job->interpreter().state().relative, outcome == JobOutcome::completed);
    }
}

TEST(JobRun, TheNextJobBeginsWithFreshModesAndAFreshStatus) {
    Bench bench;
    bench.send("G91\nM9876\n;LAYER:0\n");
    bench.read_all();
    bench.job->publish(instant_from_ns(0), true, false);
    EXPECT_EQ(bench.link.status().unknown_codes, 1u);
    EXPECT_EQ(bench.places->layers().on_extrusion(0.2), gcode::LayerFinder::Found::first);
    EXPECT_EQ(bench.places->layers().layers(), 1u);
    bench.job->end({JobOutcome::completed});
    bench.send("M107\n", 2);
    EXPECT_EQ(*bench.job->read(), Read::begun);
    bench.job->publish(instant_from_ns(0), true, false);
    EXPECT_EQ(bench.link.status().unknown_codes, 0u);
    EXPECT_EQ(bench.link.status().job_id, 2u);
    EXPECT_EQ(bench.places->layers().layers(), 0u);
    EXPECT_FALSE(bench.job->interpreter().state().relative);
}

TEST(JobRun, ACommentBeginsTheLayerOfTheNextExtrusion) {
    Bench bench;
    EXPECT_EQ(bench.places->layers().on_extrusion(0.2), gcode::LayerFinder::Found::first);
    bench.send(";LAYER:0\nM107\n;LAYER:1\n");
    bench.read_all();
    EXPECT_EQ(bench.places->layers().layers(), 0u) << "a new job";
    EXPECT_EQ(bench.places->layers().on_extrusion(0.2), gcode::LayerFinder::Found::first);
    EXPECT_EQ(bench.places->layers().on_extrusion(5), gcode::LayerFinder::Found::same) << "comments count";
}

TEST(JobRun, AnArrivalIsBegunWithoutBeingRead) {
    Bench bench;
    EXPECT_FALSE(bench.job->take_arrival());
    bench.send("M106\n", 5);
    EXPECT_TRUE(bench.job->take_arrival());
    EXPECT_EQ(bench.link.status().job_id, 5u);
    bench.job->end({JobOutcome::failed});
    EXPECT_FALSE(bench.job->take_arrival());
    EXPECT_EQ(bench.read_all(), "");
    EXPECT_TRUE(bench.recorder.log.empty());
}

TEST(JobRun, OnlyPrintingTimeCounts) {
    Bench bench;
    bench.job->publish(instant_from_ns(0), true, false);
    bench.send("M107\n");
    bench.read_all();
    bench.job->publish(instant_from_ns(2'000'000'000), true, true);
    bench.job->publish(instant_from_ns(7'000'000'000), false, true);
    bench.job->publish(instant_from_ns(8'000'000'000), true, false);
    EXPECT_EQ(bench.link.status().print_time_s, 3);
    EXPECT_EQ(bench.link.status().heating_time_s, 2);
    EXPECT_EQ(bench.link.status().bytes_accepted, 5u);
    EXPECT_EQ(bench.link.status().bytes_planned, 5u);
}

TEST(JobRun, ProgressGoesByTheEstimateThatCameWithTheJob) {
    Bench bench;
    ASSERT_TRUE(link::try_push(bench.layout->jobs, link::encode(link::JobBegin{5, 100, 60})));
    bench.read_all();
    bench.job->publish(instant_from_ns(0), true, false);
    bench.job->publish(instant_from_ns(15'000'000'000), true, false);
    EXPECT_EQ(bench.job->progress().remaining.value(), 45);
    bench.job->publish(instant_from_ns(90'000'000'000), true, false);
    EXPECT_EQ(bench.job->progress().remaining.value(), 0) << "longer than estimated";
    bench.job->end({link::JobOutcome::completed});
    EXPECT_EQ(bench.job->progress().remaining.value(), 0);
    EXPECT_EQ(bench.job->progress().passed.value(), 0) << "nothing runs";
}

}  // namespace
}  // namespace qduino::printer::machine::job_run_test
