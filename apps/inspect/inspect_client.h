// The asking side of the inspector's socket (inspect_service.h lists the questions).
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"
#include "base/time.h"

namespace qduino::apps {

class InspectClient {
  public:
    /// Does not connect yet: the machine may come and go.
    explicit InspectClient(std::string path) : path_(std::move(path)) {}

    /// Sends one request, returns the line that answers it, without its end. Connects for each call
    /// and blocks up to `timeout`: not for real-time loops, nor for a thread that serves others.
    /// Errors: not_found (no machine serves the path), timed_out, unavailable, not_permitted.
    [[nodiscard]] Result<std::string> ask(std::string_view request, Nanoseconds timeout) const;

    /// The questions about a job. `job` is the id as JSON (a number, or a string with its quotes).
    [[nodiscard]] Result<std::string> job_begin(std::string_view job, std::string_view path,
                                                Nanoseconds timeout) const;
    [[nodiscard]] Result<std::string> job_end(std::string_view job, std::uint32_t excursions,
                                              Nanoseconds timeout) const;

  private:
    std::string path_;
};

}  // namespace qduino::apps
