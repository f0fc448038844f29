#include "printer/step/feeder.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "channel/ring_buffer.h"
#include "tests/property/motion/pipeline.h"

namespace qduino::printer::step {
namespace {

using test::Pipeline;
using SmallRing = channel::RingBuffer<StepEvent, 64>;

motion::Move to(double x, double y) { return {{x, y, 0}, 0, 100, 3000, {}}; }

std::vector<StepEvent> empty_out(SmallRing& ring) {
    std::vector<StepEvent> events;
    StepEvent event;
    while (ring.try_pop(event)) events.push_back(event);
    return events;
}

TEST(Feeder, fills_the_ring_and_goes_on_where_it_stopped) {
    Pipeline fed{MachineConfig{}}, reference{MachineConfig{}};
    for (int i = 1; i <= 20; ++i) {
        ASSERT_TRUE(fed.planner->append(to(i % 3, i)));
        reference.append(to(i % 3, i));
    }
    fed.planner->flush();
    reference.finish();
    SmallRing ring;
    std::vector<StepEvent> events;
    for (std::size_t moved = 1; moved > 0;) {
        moved = feed(*fed.planner, fed.solver, ring, 1'000'000);
        ASSERT_LE(moved, 64u);
        for (const StepEvent& event : empty_out(ring)) events.push_back(event);
    }
    ASSERT_EQ(events.size(), reference.events.size());
    for (std::size_t i = 0; i < events.size(); ++i) ASSERT_EQ(events[i].time_ns, reference.events[i].time_ns);
    EXPECT_EQ(fed.solver.tail_size(), 0u);
}

TEST(Feeder, keeps_to_its_budget) {
    Pipeline pipeline{MachineConfig{}};
    pipeline.append(to(10, 0));
    pipeline.planner->flush();
    SmallRing ring;
    EXPECT_EQ(feed(*pipeline.planner, pipeline.solver, ring, 10), 10u);
    EXPECT_EQ(feed(*pipeline.planner, pipeline.solver, ring, 0), 0u);
    EXPECT_EQ(ring.size(), 10u);
}

TEST(Feeder, shows_each_segment_once) {
    Pipeline pipeline{MachineConfig{}};
    for (int i = 1; i <= 5; ++i) pipeline.append(to(i * 0.1, 0));
    pipeline.planner->flush();
    SmallRing ring;
    std::vector<double> ends_mm;
    feed(*pipeline.planner, pipeline.solver, ring, 1000,
         [&](const motion::Segment& segment) { ends_mm.push_back(segment.end_mm[0]); });
    EXPECT_EQ(ends_mm.size(), 5u);
}

TEST(Feeder, gives_nothing_while_nothing_is_final) {
    Pipeline pipeline{MachineConfig{}};
    SmallRing ring;
    EXPECT_EQ(feed(*pipeline.planner, pipeline.solver, ring, 1000), 0u);
    ASSERT_TRUE(pipeline.planner->append(to(10, 0)));
    EXPECT_EQ(feed(*pipeline.planner, pipeline.solver, ring, 1000), 0u);
}

}  // namespace
}  // namespace qduino::printer::step
