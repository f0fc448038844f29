// The service's counts and measurements. This one counts nothing; net/prometheus_metrics.h does.
#pragma once

#include <string>

#include "spool/spool.h"

namespace qduino::web {

class Metrics {
  public:
    virtual ~Metrics() = default;

    // Any thread.
    virtual void count_request(int /*status*/) {}
    virtual void count_upload(std::uint64_t /*bytes*/) {}
    virtual void count_refused_login() {}

    /// The spool's thread: reads the machine and the queue, and renders everything. Empty: nothing
    /// is counted.
    [[nodiscard]] virtual std::string text(const spool::Spool&) { return {}; }
};

}  // namespace qduino::web
