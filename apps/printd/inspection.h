// Asks the inspector of the virtual machine, from a thread of its own: its answers may take
// seconds.
//
// Without a socket there is no inspection: printing never waits for an inspector that is not there.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "inspect/inspect_server.h"
#include "spool/inspector.h"

namespace boost::asio {
class thread_pool;  // its header costs seconds in each file that includes it
}

namespace qduino::printd {

class Inspection final : public spool::Inspector {
  public:
    explicit Inspection(const std::string& socket);
    ~Inspection() override;

    void begin(std::uint64_t run, const std::string& gcode) override;
    bool begun(std::uint64_t run) override;
    void typed(std::uint64_t run, std::uint32_t number, std::uint64_t behind_line, double left_mm,
               const std::string& line) override;
    void end(std::uint64_t run, std::uint32_t excursions) override;
    std::optional<std::string> report(std::uint64_t run) override;

  private:
    struct Answers {
        bool begin_asked = false, begin_answered = false;
        bool end_asked = false;
        std::optional<std::string> report;
    };
    [[nodiscard]] std::string ask_end(std::uint64_t run, std::uint32_t excursions) const;

    apps::InspectClient client_;
    std::mutex mutex_;
    std::map<std::uint64_t, Answers> answers_;
    // Last: it ends before what its questions use.
    std::unique_ptr<boost::asio::thread_pool> thread_;
};

}  // namespace qduino::printd
