// Serial on its way to a person: through the hub, onto a terminal, into a browser, over ssh.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <nlohmann/json.hpp>

#include "qduino/common/build_step.h"
#include "qduino/common/child_process.h"
#include "qduino/common/host_name.h"
#include "qduino/monitor/monitor_text.h"
#include "qduino/monitor/plot_server.h"
#include "qduino/upload/remote.h"
#include "qduino/upload/serial_hub.h"
#include "tests/unit/qduino/temporary_folder.h"

namespace qduino::apps::monitor_test {
namespace {

using posix::UniqueFd;

class MonitorTest : public TemporaryFolder {};

TEST_F(MonitorTest, LineEndsOfASketchAreThoseOfTheTerminal) {
    MonitorText plain({});
    EXPECT_EQ(plain.shown("a\r"), "a");
    EXPECT_TRUE(plain.in_line());
    EXPECT_EQ(plain.shown("\nb\rc\n\r\n"), "\nb\nc\n\n");
    EXPECT_FALSE(plain.in_line());
    int lines = 0;
    MonitorText timed([&lines] { return std::to_string(++lines) + "> "; });
    EXPECT_EQ(timed.shown("one\r\n\r\ntw"), "1> one\n\n2> tw");
    EXPECT_EQ(timed.shown("o\n"), "o\n");
    EXPECT_EQ(with_line_ends("a\nb\n", line_end_of("crlf")), "a\r\nb\r\n");
    EXPECT_EQ(with_line_ends("a\n", line_end_of("none")), "a");
}

/// All texts of up to 6 of these bytes, cut at each place.
TEST_F(MonitorTest, HowBytesArriveChangesNothing) {
    constexpr std::string_view kBytes = "a\r\n";
    std::vector<std::string> texts{""};
    for (std::size_t i = 0; i < texts.size(); ++i) {
        for (const char byte : texts[i].size() < 6 ? kBytes : "") texts.push_back(texts[i] + byte);
    }
    EXPECT_EQ(texts.size(), 1U + 3 + 9 + 27 + 81 + 243 + 729);
    for (const std::string& text : texts) {
        const std::string whole = MonitorText({}).shown(text);
        for (std::size_t cut = 0; cut <= text.size(); ++cut) {
            MonitorText parts({});
            std::string joined = parts.shown(text.substr(0, cut));
            joined += parts.shown(text.substr(cut));
            ASSERT_EQ(joined, whole) << testing::PrintToString(text) << " cut at " << cut;
        }
    }
}

/// A client's end of a socket whose other end the hub has.
UniqueFd join_hub(SerialHub& hub) {
    int ends[2];
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends), 0);
    hub.add(UniqueFd{ends[0]});
    return UniqueFd{ends[1]};
}

void serve_all(SerialHub& hub) {
    std::vector<pollfd> looks = hub.waits();
    while (::poll(looks.data(), looks.size(), 0) > 0) {
        hub.serve(looks);
        looks = hub.waits();
    }
}

std::string all_of(const UniqueFd& fd) {
    std::string all;
    char bytes[4096];
    for (ssize_t count = 0; (count = ::read(fd.get(), bytes, sizeof bytes)) > 0;)
        all.append(bytes, static_cast<std::size_t>(count));
    return all;
}

TEST_F(MonitorTest, ANewcomerGetsWhatWasSaidBeforeItCame) {
    SerialHub hub;
    hub.take_output("before ");
    const UniqueFd first = join_hub(hub);
    serve_all(hub);
    hub.take_output("after");
    UniqueFd second = join_hub(hub);
    serve_all(hub);
    EXPECT_EQ(all_of(first), "before after");
    EXPECT_EQ(all_of(second), "before after");
    EXPECT_EQ(::write(second.get(), "typed", 5), 5);
    serve_all(hub);
    EXPECT_EQ(hub.input(), "typed");
    hub.forget_input(3);
    EXPECT_EQ(hub.input(), "ed");
    second.reset();
    serve_all(hub);
    EXPECT_EQ(hub.waits().size(), 1U);
}

TEST_F(MonitorTest, AClientThatDoesNotReadLosesTheOldestAndHoldsNobodyUp) {
    SerialHub hub;
    const UniqueFd slow = join_hub(hub);
    std::string said;
    for (int i = 0; i < 40'000; ++i) {
        const std::string piece = std::to_string(i) + " a line of the sketch\n";
        said += piece;
        hub.take_output(piece);
    }
    ASSERT_GT(said.size(), 2 * SerialHub::kWaitingMax);
    std::string seen;
    for (std::string more = "x"; !more.empty(); seen += more) {
        serve_all(hub);
        more = all_of(slow);
    }
    EXPECT_EQ(seen, said.substr(said.size() - SerialHub::kWaitingMax));
    const UniqueFd late = join_hub(hub);
    serve_all(hub);
    EXPECT_EQ(all_of(late), said.substr(said.size() - SerialHub::kBacklogMax));
}

TEST_F(MonitorTest, InputThatTheSketchDoesNotReadWaitsWithTheClient) {
    SerialHub hub;
    const UniqueFd client = join_hub(hub);
    const std::string typed(4096, 'x');
    for (int i = 0; i < 100; ++i) {
        [[maybe_unused]] const ssize_t taken = ::write(client.get(), typed.data(), typed.size());
        serve_all(hub);
    }
    EXPECT_GE(hub.input().size(), SerialHub::kInputMax);
    EXPECT_LE(hub.input().size(), SerialHub::kInputMax + typed.size());
}

std::string answer(const PlotServer& server, const std::string& target) {
    bool streams = false;
    const std::string text = server.answer_to("GET " + target + " HTTP/1.1\r\n\r\n", streams);
    return text.substr(9, 3) + (streams ? " streams" : "");
}

TEST_F(MonitorTest, ThePlotterAnswersThoseWhoKnowTheKey) {
    const auto server = PlotServer::listen(0);
    ASSERT_TRUE(server);
    const std::string key = server->address().substr(server->address().find("?key="));
    EXPECT_EQ(key.size(), 5 + 32U);
    EXPECT_TRUE(server->address().starts_with("http://127.0.0.1:"));
    EXPECT_EQ(answer(*server, "/" + key), "200");
    EXPECT_EQ(answer(*server, "/series.js" + key), "200");
    EXPECT_EQ(answer(*server, "/lines" + key), "200 streams");
    EXPECT_EQ(answer(*server, "/other" + key), "404");
    for (const std::string& wrong :
         {std::string(), std::string("?key="), key + "0", std::string("?key=") + std::string(32, '0')}) {
        EXPECT_EQ(answer(*server, "/" + wrong), "403") << wrong;
        EXPECT_EQ(answer(*server, "/lines" + wrong), "403") << wrong;
    }
    bool streams = false;
    EXPECT_TRUE(server->answer_to("POST /" + key + " HTTP/1.1\r\n\r\n", streams).starts_with("HTTP/1.1 405"));
    const auto other = PlotServer::listen(0);
    ASSERT_TRUE(other);
    EXPECT_NE(other->address().substr(other->address().find("?key=")), key);
}

TEST_F(MonitorTest, ALineIsOneEventWhateverIsInIt) {
    const std::string event = event_of("a\xff\"\n\ndata: b");
    EXPECT_EQ(event.find('\n'), event.size() - 2);
    const auto read = nlohmann::json::parse(event.substr(6)).get<std::string>();
    EXPECT_EQ(read, "a\xef\xbf\xbd\"\n\ndata: b");
}

TEST_F(MonitorTest, AHostIsNoOption) {
    for (const char* good : {"pi@printer.local", "printer", "ssh://pi@10.0.0.7:2222", "pi@[fe80::1%eth0]"})
        EXPECT_EQ(host_error(good), "") << good;
    for (const char* bad : {"", "-v", "-oProxyCommand=x", "a b", "a;b", "$(x)", "a\nb", "a'b"})
        EXPECT_NE(host_error(bad), "") << bad;
}

/// Two shells read the command: ssh's other side hands it to the user's own, as `sh -c` here.
TEST_F(MonitorTest, WordsArriveOnTheOtherComputerAsTheyWere) {
    const std::vector<std::string> words{"upload", "it's", "a b", "$HOME", "\"", "\\", "", "*"};
    write(".local/bin/qduino", "#!/bin/sh\nprintf '<%s>' \"$@\"\n");
    std::filesystem::permissions(folder_ / ".local/bin/qduino", std::filesystem::perms::owner_all);
    const auto command = remote_qduino("pi@there", words);
    ASSERT_EQ(command.size(), 4U);
    EXPECT_EQ(command[2], "pi@there");
    const auto output = folder_ / "said";
    const auto status = run_into({"env", "HOME=" + folder_.string(), "sh", "-c", command[3]}, output);
    ASSERT_TRUE(status);
    EXPECT_EQ(text_of(output), "<upload><it's><a b><$HOME><\"><\\><><*>");
}

}  // namespace
}  // namespace qduino::apps::monitor_test
