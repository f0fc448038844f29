// The port of a serial host, carried by a process of its own: what the host says reaches the
// service, and an M112 the link, whoever else is there.
#include "apps/port/port_relay.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "serial/serial_session.h"
#include "tests/unit/serial/noisy_host.h"

namespace qduino::port::port_relay_test {
namespace {

using apps::SerialPort;

class PortRelayTest : public testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "port-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder = pattern;
        auto port = SerialPort::make_pty(folder / "serial");
        ASSERT_TRUE(port.ok());
        relay.emplace(std::move(*port), folder / "socket", folder / "link");
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    void serve() {
        auto made = SerialPort::relayed(folder / "socket", true);
        ASSERT_TRUE(made.ok()) << made.error().message.view();
        service.emplace(std::move(*made));
    }
    void open() { host = posix::UniqueFd{::open((folder / "serial").c_str(), O_RDWR | O_NONBLOCK)}; }
    void say(const std::string& bytes) {
        ASSERT_EQ(::write(host.get(), bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    }
    /// Turns until `done`; false: that never comes.
    template <typename Done>
    bool turn_until(Done done) {
        for (int turns = 0; turns < 400; ++turns) {
            if (done()) return true;
            relay->turn();
        }
        return done();
    }
    bool is_there() {
        return turn_until([this] { return service->host_is_there(); });
    }
    /// What the service has read so far.
    const std::string& heard() {
        std::array<char, 4096> bytes{};
        const auto count = service->host_is_there() ? service->read(bytes) : Result<std::size_t>{0};
        if (count.ok()) heard_.append(bytes.data(), *count);
        return heard_;
    }

    std::filesystem::path folder;
    std::optional<PortRelay> relay;
    std::optional<SerialPort> service;
    posix::UniqueFd host;
    std::string heard_;
};

TEST_F(PortRelayTest, TheServiceSeesAHostComeAndGoAndHearsItsLastWords) {
    serve();
    for (int turns = 0; turns < 3; ++turns) relay->turn();
    EXPECT_FALSE(service->host_is_there());
    open();
    ASSERT_TRUE(is_there());
    say("G28\n");
    ASSERT_TRUE(turn_until([this] { return heard() == "G28\n"; })) << heard();
    EXPECT_EQ(service->write("ok\n"), 3u);
    std::array<char, 8> answer{};
    ASSERT_TRUE(turn_until([&] { return ::read(host.get(), answer.data(), answer.size()) == 3; }));
    EXPECT_EQ(std::string(answer.data(), 3), "ok\n");
    host.reset();
    EXPECT_TRUE(turn_until([this] { return !service->host_is_there(); }));
}

TEST_F(PortRelayTest, M112StopsThePrinterWithNoServiceAtAll) {
    const auto link = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(link.ok()) << link.error().message.view();
    open();
    say("G1 X10\nM117 M112 is no code here\nM11");
    for (int turns = 0; turns < 5; ++turns) relay->turn();
    EXPECT_EQ(link->get()->emergency.load(), 0u);
    say("2\n");
    EXPECT_TRUE(turn_until([&] { return link->get()->emergency.load() == 1; }));
    EXPECT_GT(link->get()->port_stop_ns.load(), 0);
}

TEST_F(PortRelayTest, AHostThatHasGoneIsHeardToItsLastByte) {
    const auto link = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(link.ok());
    open();
    for (int turns = 0; turns < 3; ++turns) relay->turn();
    for (int i = 0; i < 500; ++i) say("G1 X90 Y20 F6000\n");
    say("M11");
    say("2\n");
    host.reset();
    EXPECT_TRUE(turn_until([&] { return link->get()->emergency.load() == 1; }));
}

TEST_F(PortRelayTest, AHostThatCameAndWentBetweenTwoLooksIsHeard) {
    const auto link = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(link.ok());
    for (int turns = 0; turns < 3; ++turns) relay->turn();
    open();
    say("M112\n");
    host.reset();
    EXPECT_TRUE(turn_until([&] { return link->get()->emergency.load() == 1; }));
    open();
    for (int turns = 0; turns < 3; ++turns) relay->turn();
    EXPECT_EQ(link->get()->emergency.load(), 1u) << "and heard once";
}

TEST_F(PortRelayTest, ItStopsTheSketchThatRunsNow) {
    const auto before = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(before.ok());
    open();
    say("M105\n");
    for (int turns = 0; turns < 5; ++turns) relay->turn();
    const auto after = apps::create_link(folder / "link", 2);
    ASSERT_TRUE(after.ok());
    say("M112\n");
    EXPECT_TRUE(turn_until([&] { return after->get()->emergency.load() == 1; }));
    EXPECT_EQ(before->get()->emergency.load(), 0u);
}

TEST_F(PortRelayTest, M112IsSeenBehindLinesThatTheServiceDoesNotRead) {
    const auto link = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(link.ok());
    serve();
    open();
    ASSERT_TRUE(is_there());
    for (int i = 0; i < 1500; ++i) {
        say("G1 X90 Y20 F6000\n");
        relay->turn();
    }
    say("M112\n");
    EXPECT_TRUE(turn_until([&] { return link->get()->emergency.load() == 1; }));
}

/// More than any queue on the way holds: this process's, the socket's, the terminal's.
constexpr int kFlood = 40'000;

TEST_F(PortRelayTest, M112IsSeenBehindMoreThanAnyQueueHolds) {
    const auto link = apps::create_link(folder / "link", 1);
    ASSERT_TRUE(link.ok());
    serve();
    open();
    ASSERT_TRUE(is_there());
    for (int i = 0; i < kFlood; ++i) {
        const std::string line = "G1 X90 Y20 F6000\n";
        ASSERT_EQ(::write(host.get(), line.data(), line.size()), static_cast<ssize_t>(line.size()))
            << "the port is not read any more, after " << i << " lines";
        if (i % 8 == 0) relay->turn();
    }
    say("M112\n");
    EXPECT_TRUE(turn_until([&] { return link->get()->emergency.load() == 1; }));
}

/// The service stands still while a host sends without waiting for an answer; then it goes on, and
/// the host does what it is asked. The generator is `lines`: what the printer gets must be that.
TEST_F(PortRelayTest, WhatDidNotFitIsAskedForAgainAndNothingIsLostOrDoubled) {
    serve();
    open();
    ASSERT_TRUE(is_there());
    std::vector<std::string> lines;
    for (int i = 0; i < kFlood; ++i)
        lines.push_back("G1 X" + std::to_string(i % 200) + " F" + std::to_string(i));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        say(tests::numbered(static_cast<std::int64_t>(i) + 1, lines[i]));
        if (i % 8 == 0) relay->turn();
    }
    apps::SerialSession session;
    apps::PrinterNews news{.connected = true, .session = 1};
    const Instant now = instant_from_ns(0);
    session.learn(news, now);
    session.open();
    tests::PingPongHost again{lines};
    std::vector<std::string> crossed;
    bool flooded = true;
    std::string to_host;
    std::size_t asked_again = 0;
    for (int turns = 0; turns < 400'000 && crossed.size() < lines.size(); ++turns) {
        relay->turn();
        std::array<char, 4096> bytes{};
        const auto count = service->host_is_there() ? service->read(bytes) : Result<std::size_t>{0};
        if (count.ok()) session.take(std::span{bytes}.first(*count), now);
        for (const apps::HostLine& line : session.take_lines()) crossed.push_back(line.text);
        news.lines_over += session.under_way();
        session.learn(news, now);
        to_host += session.take_output();
        asked_again += to_host.find("Resend: ") != std::string::npos ? 1 : 0;
        flooded = flooded && asked_again == 0;
        if (!flooded) {
            again.hear(to_host);
            say(again.speak());
        }
        to_host.clear();
    }
    EXPECT_GT(asked_again, 0u);
    EXPECT_LT(asked_again, 10'000u) << "a gap is asked for once, and not line by line";
    ASSERT_EQ(crossed.size(), lines.size());
    EXPECT_TRUE(std::ranges::equal(crossed, lines));
}

TEST_F(PortRelayTest, AServiceThatComesBackIsConnectedAnew) {
    serve();
    open();
    ASSERT_TRUE(is_there());
    service.reset();
    say("lost\n");
    for (int turns = 0; turns < 3; ++turns) relay->turn();
    serve();
    ASSERT_TRUE(is_there());
    say("M105\n");
    EXPECT_TRUE(turn_until([this] { return heard() == "M105\n"; })) << heard();
}

/// A turn costs what it uses, divided by the share U. An ordinary user gets the budget without the
/// rank.
TEST(PortVcpuTest, PaysForItsTurnsOnceASketchSaysHow) {
    PortVcpu vcpu;
    vcpu.begin();
    vcpu.end();
    EXPECT_EQ(vcpu.recovery_of(10us), 0ns) << "no sketch: no budget";
    printer::link::PortVcpu published;
    vcpu.follow(&published);
    EXPECT_EQ(vcpu.recovery_of(10us), 0ns) << "nothing published: an ordinary process";
    published.publish({.core = 0, .priority = 1, .budget = 2ms, .period = 100ms, .client = 8ms});
    vcpu.follow(&published);
    EXPECT_EQ(vcpu.recovery_of(10us), 500us);
    vcpu.begin();
    vcpu.end();
    vcpu.follow(nullptr);
    EXPECT_EQ(vcpu.recovery_of(10us), 0ns);
}

}  // namespace
}  // namespace qduino::port::port_relay_test
