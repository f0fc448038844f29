#include "inspect/inspect_server.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <cstring>
#include <thread>

#include "inspect/inspect_server.h"
#include "tests/unit/twin/temporary_folder.h"

namespace qduino::apps::inspect_server_test {
namespace {

using twin::testing::TemporaryFolder;

/// A server that repeats what it is told, in a thread, until it goes.
class Echo {
  public:
    explicit Echo(const std::string& path)
        : server_(InspectServer::listen(
              path, [](std::string_view line) { return "<" + std::string(line) + ">"; })) {
        if (server_)
            thread_ = std::thread([this] {
                while (!stop_) {
                    server_->poll();
                    std::this_thread::sleep_for(std::chrono::milliseconds{1});
                }
            });
    }
    ~Echo() {
        stop_ = true;
        if (thread_.joinable()) thread_.join();
    }
    [[nodiscard]] const Result<InspectServer>& result() const { return server_; }

  private:
    Result<InspectServer> server_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

int connect_to(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    const int fd = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    EXPECT_EQ(::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return fd;
}

std::string read_to_end(int fd) {
    std::string all;
    char bytes[4096];
    for (ssize_t count; (count = ::recv(fd, bytes, sizeof bytes, 0)) > 0;)
        all.append(bytes, static_cast<std::size_t>(count));
    return all;
}

TEST(InspectServer, AnswersItsClients) {
    const TemporaryFolder folder;
    const Echo echo(folder / "s");
    ASSERT_TRUE(echo.result().ok());
    const InspectClient client(folder / "s");
    for (int i = 0; i < 20; ++i) {
        const Result<std::string> answer = client.ask("hello " + std::to_string(i), 5s);
        ASSERT_TRUE(answer.ok()) << answer.error().message.view();
        EXPECT_EQ(*answer, "<hello " + std::to_string(i) + ">");
    }
}

TEST(InspectServer, LargeAnswersArriveWhole) {
    const TemporaryFolder folder;
    const std::string large(3'000'000, 'x');
    std::atomic<bool> stop{false};
    Result<InspectServer> server =
        InspectServer::listen(folder / "s", [&](std::string_view) { return large; });
    ASSERT_TRUE(server.ok());
    std::thread loop([&] {
        while (!stop) server->poll();
    });
    const Result<std::string> answer = InspectClient(folder / "s").ask("?", 10s);
    stop = true;
    loop.join();
    ASSERT_TRUE(answer.ok()) << answer.error().message.view();
    EXPECT_EQ(answer->size(), large.size());
}

TEST(InspectServer, LinesMayComeInPiecesAndTogether) {
    const TemporaryFolder folder;
    const Echo echo(folder / "s");
    const int fd = connect_to(folder / "s");
    for (const char* piece : {"a", "b\nc", "d\n\ne\n"}) {
        ASSERT_GT(::send(fd, piece, std::strlen(piece), 0), 0);
        std::this_thread::sleep_for(std::chrono::milliseconds{5});
    }
    std::string all;
    const std::string expected = "<ab>\n<cd>\n<>\n<e>\n";
    char byte = 0;
    while (all.size() < expected.size() && ::recv(fd, &byte, 1, 0) == 1) all += byte;
    EXPECT_EQ(all, expected);
    ::close(fd);
}

TEST(InspectServer, AnEndlessLineIsHungUpOnAndOthersAreServed) {
    const TemporaryFolder folder;
    const Echo echo(folder / "s");
    const int fd = connect_to(folder / "s");
    const std::string flood(64 * 1024, 'x');
    ::send(fd, flood.data(), flood.size(), MSG_NOSIGNAL);
    EXPECT_EQ(read_to_end(fd), "");
    ::close(fd);
    EXPECT_TRUE(InspectClient(folder / "s").ask("still there?", 5s).ok());
}

TEST(InspectServer, TooManyClientsAreTurnedAwayUntilOneGoes) {
    const TemporaryFolder folder;
    const Echo echo(folder / "s");
    std::vector<int> idle;
    for (std::size_t i = 0; i < InspectServer::kClients; ++i) idle.push_back(connect_to(folder / "s"));
    // A connection only counts once it was accepted, one each poll: ask the last one something.
    ::send(idle.back(), "x\n", 2, 0);
    char answer[4];
    ASSERT_EQ(::recv(idle.back(), answer, sizeof answer, MSG_WAITALL), 4);
    const Result<std::string> refused = InspectClient(folder / "s").ask("?", 5s);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::unavailable);
    for (const int fd : idle) ::close(fd);
    Result<std::string> served = refused;
    for (int i = 0; i < 200 && !served.ok(); ++i) served = InspectClient(folder / "s").ask("?", 5s);
    EXPECT_TRUE(served.ok());
}

TEST(InspectServer, TheSocketIsForItsOwnerAndGoesWithTheServer) {
    const TemporaryFolder folder;
    struct stat status {};
    {
        const Echo echo(folder / "s");
        ASSERT_EQ(::stat((folder / "s").c_str(), &status), 0);
        EXPECT_EQ(status.st_mode & 0777u, 0600u);
    }
    EXPECT_NE(::stat((folder / "s").c_str(), &status), 0);
    const Result<std::string> answer = InspectClient(folder / "s").ask("?", 1s);
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, ErrorCode::not_found);
}

TEST(InspectServer, ASecondServerIsRefusedAndALeftSocketIsReplaced) {
    const TemporaryFolder folder;
    {
        const Echo first(folder / "s");
        const Echo second(folder / "s");
        ASSERT_FALSE(second.result().ok());
        EXPECT_EQ(second.result().error().code, ErrorCode::already_exists);
        EXPECT_TRUE(InspectClient(folder / "s").ask("?", 5s).ok()) << "the first is unharmed";
    }
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    const std::string path = folder / "s";
    std::memcpy(address.sun_path, path.data(), path.size());
    const int dead = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    ASSERT_EQ(::bind(dead, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ::close(dead);
    const Echo third(path);
    EXPECT_TRUE(third.result().ok());
    folder.write("file", "precious");
    const Echo fourth(folder / "file");
    EXPECT_FALSE(fourth.result().ok()) << "what is no socket is not touched";
    const Echo fifth(folder / std::string(200, 'x'));
    ASSERT_FALSE(fifth.result().ok());
    EXPECT_EQ(fifth.result().error().code, ErrorCode::invalid_argument);
}

TEST(InspectClient, GivesUpWhenNobodyAnswers) {
    const TemporaryFolder folder;
    // Listening, and never polled.
    const Result<InspectServer> silent =
        InspectServer::listen(folder / "s", [](std::string_view) { return std::string{}; });
    ASSERT_TRUE(silent.ok());
    const Result<std::string> answer = InspectClient(folder / "s").ask("?", 50ms);
    ASSERT_FALSE(answer.ok());
    EXPECT_EQ(answer.error().code, ErrorCode::timed_out);
}

}  // namespace
}  // namespace qduino::apps::inspect_server_test
