// The service's counts and measurements, as Prometheus text.
#pragma once

#include <memory>
#include <string>

#include "web/metrics.h"

namespace qduino::web {

class PrometheusMetrics final : public Metrics {
  public:
    PrometheusMetrics();
    ~PrometheusMetrics() override;

    void count_request(int status) override;
    void count_upload(std::uint64_t bytes) override;
    void count_refused_login() override;
    [[nodiscard]] std::string text(const spool::Spool& spool) override;

  private:
    struct Families;
    std::unique_ptr<Families> families_;
};

}  // namespace qduino::web
