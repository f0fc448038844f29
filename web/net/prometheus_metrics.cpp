#include "web/net/prometheus_metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <array>

#include "web/api/json.h"

namespace qduino::web {

namespace {

prometheus::Family<prometheus::Counter>& counters(prometheus::Registry& registry, const char* name,
                                                  const char* help) {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
}

prometheus::Family<prometheus::Gauge>& gauges(prometheus::Registry& registry, const char* name,
                                              const char* help) {
    return prometheus::BuildGauge().Name(name).Help(help).Register(registry);
}

constexpr std::array<const char*, 5> kStatusClasses{"1xx", "2xx", "3xx", "4xx", "5xx"};

}  // namespace

struct PrometheusMetrics::Families {
    prometheus::Registry registry;
    prometheus::Family<prometheus::Counter>& requests =
        counters(registry, "qduino_http_requests_total", "Requests answered, by class of status");
    prometheus::Counter& uploads = counters(registry, "qduino_uploads_total", "Files received whole").Add({});
    prometheus::Counter& upload_bytes =
        counters(registry, "qduino_upload_bytes_total", "Bytes of files received whole").Add({});
    prometheus::Counter& refused_logins =
        counters(registry, "qduino_refused_logins_total", "Requests with a wrong key or none").Add({});
    prometheus::Family<prometheus::Gauge>& jobs = gauges(registry, "qduino_jobs", "Jobs by state");
    prometheus::Gauge& connected =
        gauges(registry, "qduino_machine_connected", "1 when a machine answers").Add({});
    prometheus::Gauge& printing = gauges(registry, "qduino_machine_printing", "1 while a job prints").Add({});
    prometheus::Family<prometheus::Gauge>& celsius =
        gauges(registry, "qduino_temperature_celsius", "Measured temperature by heater");
    prometheus::Family<prometheus::Gauge>& target =
        gauges(registry, "qduino_temperature_target_celsius", "Target temperature by heater, 0: off");
    prometheus::Family<prometheus::Gauge>& lateness =
        gauges(registry, "qduino_step_lateness_seconds", "Lateness of steps in this session, by quantile");
    prometheus::Gauge& late_steps =
        gauges(registry, "qduino_late_steps", "Steps in this session that moved the time line").Add({});
    prometheus::Gauge& starved = gauges(registry, "qduino_step_ring_starved",
                                        "Times the step ring ran dry in mid-move, in this session")
                                     .Add({});
    prometheus::Gauge& steps = gauges(registry, "qduino_steps", "Steps played in this session").Add({});
    prometheus::Gauge& replies_dropped = gauges(registry, "qduino_replies_dropped",
                                                "Lines of text that the link could not take, in this session")
                                             .Add({});
};

PrometheusMetrics::PrometheusMetrics() : families_(std::make_unique<Families>()) {}
PrometheusMetrics::~PrometheusMetrics() = default;

void PrometheusMetrics::count_request(int status) {
    const int index = status / 100 - 1;
    if (index < 0 || index >= static_cast<int>(kStatusClasses.size())) return;
    families_->requests.Add({{"status", kStatusClasses[static_cast<std::size_t>(index)]}}).Increment();
}

void PrometheusMetrics::count_upload(std::uint64_t bytes) {
    families_->uploads.Increment();
    families_->upload_bytes.Increment(static_cast<double>(bytes));
}

void PrometheusMetrics::count_refused_login() { families_->refused_logins.Increment(); }

std::string PrometheusMetrics::text(const spool::Spool& spool) {
    Families& f = *families_;
    spool::JobCounts counts = spool.counts();
    for (const spool::JobState state :
         {spool::JobState::queued, spool::JobState::printing, spool::JobState::done,
          spool::JobState::cancelled, spool::JobState::failed}) {
        f.jobs.Add({{"state", std::string{to_word(state)}}}).Set(static_cast<double>(counts.of(state)));
    }
    const spool::MachineView& machine = spool.machine();
    const std::string_view state = api::machine_word(machine);
    f.connected.Set(state == "disconnected" ? 0 : 1);
    f.printing.Set(state == "printing" ? 1 : 0);
    f.celsius.Add({{"heater", "hot_end"}}).Set(machine.heat.hot_end.celsius);
    f.celsius.Add({{"heater", "bed"}}).Set(machine.heat.bed.celsius);
    f.target.Add({{"heater", "hot_end"}}).Set(machine.heat.hot_end.target_celsius);
    f.target.Add({{"heater", "bed"}}).Set(machine.heat.bed.target_celsius);
    const Histogram& lateness = machine.motion.lateness_ns;
    for (const auto& [name, quantile] :
         {std::pair{"0.5", 0.5}, {"0.99", 0.99}, {"0.9999", 0.9999}, {"1", 1.0}}) {
        f.lateness.Add({{"quantile", name}}).Set(static_cast<double>(lateness.quantile(quantile)) * 1e-9);
    }
    f.late_steps.Set(static_cast<double>(machine.motion.late_steps));
    f.starved.Set(static_cast<double>(machine.motion.starved));
    f.steps.Set(static_cast<double>(lateness.count()));
    f.replies_dropped.Set(static_cast<double>(machine.job.replies_dropped));
    return prometheus::TextSerializer{}.Serialize(f.registry.Collect());
}

}  // namespace qduino::web
