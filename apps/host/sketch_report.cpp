#include "apps/host/sketch_report.h"

#include <array>
#include <cstdio>

#include "sched/explain.h"

namespace qduino::apps {

namespace {

std::string text_of(Nanoseconds duration) { return std::string(sched::duration_text(duration).view()); }
std::string text_of(std::uint64_t ns) { return text_of(Nanoseconds{static_cast<std::int64_t>(ns)}); }

}  // namespace

std::string loop_table(const std::vector<const runtime::Loop*>& loops) {
    std::string table =
        "loop  passes  releases  overruns  dropped  worst late  latency p50      p99.9        max\n";
    for (const runtime::Loop* loop : loops) {
        const runtime::LoopStatistics& counted = loop->statistics;
        const Histogram& latency = counted.release_latency_ns;
        std::array<char, 160> line{};
        std::snprintf(line.data(), line.size(), "%4d %7lld %9lld %9lld %8lld %11s %12s %10s %10s\n",
                      int{loop->declaration.id}, static_cast<long long>(counted.passes.get()),
                      static_cast<long long>(counted.releases.get()),
                      static_cast<long long>(counted.overruns.get()),
                      static_cast<long long>(counted.dropped.get()),
                      text_of(Nanoseconds{counted.lateness_ns_max.get()}).c_str(),
                      text_of(latency.quantile(0.5)).c_str(), text_of(latency.quantile(0.999)).c_str(),
                      text_of(latency.max()).c_str());
        table += line.data();
    }
    return table;
}

}  // namespace qduino::apps
