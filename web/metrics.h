// The service's counts and measurements, as Prometheus text.
#pragma once

#include <memory>
#include <string>

#include "spool/spool.h"

namespace qduino::web {

class Metrics {
  public:
    Metrics();
    ~Metrics();

    // Any thread.
    void count_request(int status);
    void count_upload(std::uint64_t bytes);
    void count_refused_login();

    /// The spool's thread: reads the machine and the queue, and renders everything.
    [[nodiscard]] std::string text(const spool::Spool& spool);

  private:
    struct Families;
    std::unique_ptr<Families> families_;
};

}  // namespace qduino::web
