// Asks the inspector of the virtual machine, from a thread of its own: its answers may take
// seconds.
//
// Without a socket there is no inspection: printing never waits for an inspector that is not there.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "apps/inspect/inspect_client.h"
#include "spool/inspector.h"

namespace qduino::printd {

class Inspection final : public spool::Inspector {
  public:
    explicit Inspection(const std::string& socket);
    ~Inspection() override;
    Inspection(const Inspection&) = delete;
    Inspection& operator=(const Inspection&) = delete;

    void begin(std::uint64_t run, const std::filesystem::path& gcode) override;
    bool begun(std::uint64_t run) override;
    void end(std::uint64_t run, std::uint32_t excursions) override;
    std::optional<std::string> report(std::uint64_t run) override;

  private:
    struct Question {
        std::uint64_t run = 0;
        std::string path;
        bool is_end = false;
        std::uint32_t excursions = 0;
    };
    struct Answers {
        bool begin_asked = false, begin_answered = false;
        bool end_asked = false;
        std::optional<std::string> report;
    };
    void ask(Question question);
    void serve();
    [[nodiscard]] std::string ask_end(std::uint64_t run, std::uint32_t excursions) const;

    apps::InspectClient client_;
    std::mutex mutex_;
    std::condition_variable asked_;
    std::deque<Question> questions_;
    std::map<std::uint64_t, Answers> answers_;
    bool stop_ = false;
    std::thread thread_;
};

}  // namespace qduino::printd
