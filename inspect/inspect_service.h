// The inspector as a service: questions about the twin in, answers out, one JSON object on one line
// each.
//
//   {"op":"job_begin","job":ID,"path":"/…/file.gcode"}
//       watches from now on; no change when this job is being watched already
//   {"op":"job_end","job":ID,"excursions":N}
//       plays what is on its way, ends the watch, answers with the report; asked again, the same
//       report. N: how often the machine reports that it left the path and came back (pauses);
//       0 when it is not given
//   {"op":"job_typed","job":ID,"number":N,"behind_line":L,"left_mm":0.8,"line":"M221 S90"}
//       the Nth line, from 0, that a person typed of the job's objects or of its flow, when the
//       machine had read the file up to line L, and had 0.8 mm of that line's filament still to lay
//       down. Asked again, it changes nothing
//   {"op":"state"}
//       positions, temperatures, duties, losses, switches
//   {"op":"fault","fault":"sensor_stuck:hot_end@5"}
//       twin/fault.h; @ counts from now
//   {"op":"clear_faults"}
//
// Answers: {"ok":true, …} or {"ok":false,"error":"…"}. ID is a JSON string or number and stands for
// itself.
//
// A client may die and come again at any time, so begin and end may be repeated. A begin for
// another job ends the watch over the one before, and keeps its report. The last kReportsKept
// reports can be asked for.
//
// One thread: the one that drives the twin's pins.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "base/time.h"
#include "inspect/inspect_server.h"
#include "twin/job.h"
#include "twin/printer.h"

namespace qduino::apps {

class InspectService {
  public:
    static constexpr std::size_t kReportsKept = 16;

    /// `drain` plays everything that has reached the pins so far, and returns the twin's present
    /// instant.
    InspectService(twin::Printer& printer, std::function<Instant()> drain);

    /// Takes any bytes, and returns one line of JSON without the line's end.
    [[nodiscard]] std::string answer(std::string_view request);

  private:
    struct Ended {
        std::string job;
        std::string report;
    };

    std::string begin(const std::string& job, const std::string& path);
    std::string typed(const std::string& job, std::uint64_t number, std::uint64_t behind_line, double left_mm,
                      const std::string& line);
    std::string end(const std::string& job, std::uint64_t excursions_told);
    std::string state();
    std::string fault(const std::string& text);
    void end_watch(std::uint64_t excursions_told);

    twin::Printer& printer_;
    std::function<Instant()> drain_;
    std::string job_id_;
    std::unique_ptr<twin::Job> job_;
    std::uint64_t typed_ = 0;  // lines typed beside it
    std::optional<twin::InspectionStart> last_place_;
    std::deque<Ended> ended_;
};

/// Serves `service` at `path` (InspectServer::listen); an empty path is served by nobody: null.
Result<std::unique_ptr<InspectServer>> serve_inspector(const std::string& path, InspectService& service);

}  // namespace qduino::apps
