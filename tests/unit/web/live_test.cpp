#include "web/live.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace qduino::web::live_test {
namespace {

using ::testing::ElementsAre;

Message message(const char* text) { return std::make_shared<const std::string>(text); }

std::vector<std::string> drain(LiveQueue& queue) {
    std::vector<std::string> all;
    while (auto next = queue.pop()) all.push_back(**next);
    return all;
}

TEST(LiveQueue, OfAStatusOnlyTheNewestWaitsRepliesKeepTheirOrder) {
    LiveQueue queue;
    queue.push(MessageKind::status, message("s1"));
    queue.push(MessageKind::reply, message("r1"));
    queue.push(MessageKind::status, message("s2"));
    queue.push(MessageKind::reply, message("r2"));
    queue.push(MessageKind::jobs, message("j"));
    EXPECT_THAT(drain(queue), ElementsAre("s2", "r1", "r2", "j"));
}

TEST(LiveQueue, IsBoundedAndSaysWhatItDropped) {
    LiveQueue queue;
    for (int i = 0; i < 1000; ++i) queue.push(MessageKind::reply, message("r"));
    EXPECT_EQ(queue.size(), LiveQueue::kWaitingMax);
    EXPECT_EQ(queue.dropped(), 1000 - LiveQueue::kWaitingMax);
    const auto all = drain(queue);
    EXPECT_EQ(all.size(), LiveQueue::kWaitingMax + 1);
    EXPECT_THAT(all.back(), ::testing::HasSubstr("800 lines were dropped"));
}

TEST(TemperatureHistory, KeepsTenMinutes) {
    TemperatureHistory history;
    for (int i = 0; i < 700; ++i) history.add({static_cast<double>(i), 200, 210, 60, 65});
    const auto json = nlohmann::json::parse(history.json());
    EXPECT_EQ(json["type"], "history");
    ASSERT_EQ(json["t_s"].size(), 600u);
    EXPECT_EQ(json["t_s"][0], 100);
    EXPECT_EQ(json["hot_end_target_c"][599], 210);
    EXPECT_EQ(json["bed_c"].size(), 600u);
}

TEST(LiveHub, GivesANewcomerTheNewestOfEachAndThenEverything) {
    LiveHub hub;
    hub.publish(MessageKind::status, "s1");
    hub.publish(MessageKind::jobs, "j1");
    hub.publish(MessageKind::reply, "r1");
    std::vector<std::string> got;
    const auto id = hub.subscribe([&](MessageKind, const Message& text) { got.push_back(*text); });
    ASSERT_TRUE(id.has_value());
    ASSERT_EQ(got.size(), 3u);
    EXPECT_EQ(got[0], "s1");
    EXPECT_EQ(got[1], "j1");
    EXPECT_THAT(got[2], ::testing::HasSubstr("history"));
    hub.publish(MessageKind::reply, "r2");
    EXPECT_EQ(got.back(), "r2");
    hub.unsubscribe(*id);
    hub.publish(MessageKind::reply, "r3");
    EXPECT_EQ(got.back(), "r2");
}

TEST(LiveHub, TakesOnlySoMany) {
    LiveHub hub;
    for (std::size_t i = 0; i < LiveHub::kSubscribersMax; ++i) {
        ASSERT_TRUE(hub.subscribe([](MessageKind, const Message&) {}).has_value());
    }
    EXPECT_FALSE(hub.subscribe([](MessageKind, const Message&) {}).has_value());
}

}  // namespace
}  // namespace qduino::web::live_test
