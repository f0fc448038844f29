// The port of a serial host, carried by a process of its own: what the host says reaches the
// service, and an M112 the link, whoever else is there.
#include "apps/port/port_relay.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <optional>
#include <string>

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
