// The inspector's side of printd: told before the first byte, asked after the last, and never
// waited for when absent.
#include "apps/printd/inspection.h"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <nlohmann/json.hpp>
#include <vector>

namespace qduino::printd::inspection_test {
namespace {

/// Answers every line that comes over a socket.
class Answerer {
  public:
    explicit Answerer(std::string path)
        : path_(std::move(path)), listener_(::socket(AF_UNIX, SOCK_STREAM, 0)) {
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path_.copy(address.sun_path, sizeof address.sun_path - 1);
        if (::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) std::abort();
        if (::listen(listener_, 8) != 0) std::abort();
        thread_ = std::thread{[this] { serve(); }};
    }
    ~Answerer() {
        stop_ = true;
        thread_.join();
        ::close(listener_);
    }
    std::mutex mutex;
    std::vector<std::string> asked;

  private:
    void serve() {
        while (!stop_) {
            pollfd waiting{listener_, POLLIN, 0};
            if (::poll(&waiting, 1, 20) <= 0) continue;
            const int client = ::accept(listener_, nullptr, nullptr);
            std::string line;
            char byte = 0;
            while (::read(client, &byte, 1) == 1 && byte != '\n') line += byte;
            const auto question = nlohmann::json::parse(line, nullptr, false);
            const bool end = question.is_object() && question["op"] == "job_end";
            const std::string answer =
                end ? "{\"ok\":true,\"report\":{\"completed\":true}}\n" : "{\"ok\":true}\n";
            {
                // Before the answer: whoever has that looks here.
                const std::scoped_lock lock{mutex};
                asked.push_back(line);
            }
            if (::write(client, answer.data(), answer.size()) < 0) std::abort();
            ::close(client);
        }
    }
    std::string path_;
    int listener_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

template <typename Condition>
bool becomes(Condition condition) {
    for (int i = 0; i < 1000; ++i) {
        if (condition()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds{10});
    }
    return false;
}

class InspectionTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string pattern = (std::filesystem::temp_directory_path() / "inspect-XXXXXX").string();
        ASSERT_NE(::mkdtemp(pattern.data()), nullptr);
        folder_ = pattern;
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }
    std::filesystem::path folder_;
};

TEST_F(InspectionTest, BeginsEndsAndReportsEachOnce) {
    Answerer answerer{folder_ / "socket"};
    Inspection inspection{folder_ / "socket"};
    EXPECT_FALSE(inspection.begun(7));
    inspection.begin(7, folder_ / "part.gcode");
    inspection.begin(7, folder_ / "part.gcode");
    ASSERT_TRUE(becomes([&] { return inspection.begun(7); }));
    EXPECT_FALSE(inspection.report(7).has_value());
    inspection.end(7, 2);
    inspection.end(7, 2);
    ASSERT_TRUE(becomes([&] { return inspection.report(7).has_value(); }));
    EXPECT_EQ(*inspection.report(7), R"({"completed":true})");
    const std::scoped_lock lock{answerer.mutex};
    ASSERT_EQ(answerer.asked.size(), 2u);
    const auto begin = nlohmann::json::parse(answerer.asked[0]);
    EXPECT_EQ(begin["op"], "job_begin");
    EXPECT_EQ(begin["job"], 7);
    EXPECT_EQ(begin["path"], (folder_ / "part.gcode").string());
    const auto end = nlohmann::json::parse(answerer.asked[1]);
    EXPECT_EQ(end["job"], 7);
    EXPECT_EQ(end["excursions"], 2) << "what the machine tells of is handed on";
}

TEST_F(InspectionTest, AnAbsentInspectorHoldsUpNothing) {
    Inspection inspection{folder_ / "nobody"};
    inspection.begin(1, "x");
    ASSERT_TRUE(becomes([&] { return inspection.begun(1); }));
    inspection.end(1, 0);
    ASSERT_TRUE(becomes([&] { return inspection.report(1).has_value(); }));
    EXPECT_EQ(*inspection.report(1), "") << "there will be no report";
}

}  // namespace
}  // namespace qduino::printd::inspection_test
