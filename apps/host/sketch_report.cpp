#include "apps/host/sketch_report.h"

#include <algorithm>
#include <array>
#include <cstdio>

#include "apps/terminal/human.h"

namespace qduino::apps {

namespace {

std::string text_of(std::uint64_t ns) { return human_duration(Nanoseconds{static_cast<std::int64_t>(ns)}); }

long long sum_of(const std::vector<const runtime::Loop*>& loops,
                 runtime::Counter runtime::LoopStatistics::*counter) {
    long long sum = 0;
    for (const runtime::Loop* loop : loops) sum += static_cast<long long>((loop->statistics.*counter).get());
    return sum;
}

}  // namespace

std::string loop_table(const std::vector<const runtime::Loop*>& loops) {
    std::string table =
        "                                                        release latency\n"
        "loop   passes releases overruns dropped  worst late      p50    p99.9      max\n";
    for (const runtime::Loop* loop : loops) {
        const runtime::LoopStatistics& was = loop->statistics;
        const Histogram& latency = was.release_latency_ns;
        std::array<char, 160> line{};
        std::snprintf(line.data(), line.size(), "%4d %8lld %8lld %8lld %7lld  %10s %8s %8s %8s\n",
                      int{loop->declaration.id}, static_cast<long long>(was.passes.get()),
                      static_cast<long long>(was.releases.get()), static_cast<long long>(was.overruns.get()),
                      static_cast<long long>(was.dropped.get()),
                      human_duration(Nanoseconds{was.lateness_ns_max.get()}).c_str(),
                      text_of(latency.quantile(0.5)).c_str(), text_of(latency.quantile(0.999)).c_str(),
                      text_of(latency.max()).c_str());
        table += line.data();
    }
    return table;
}

std::string periods_kept(const std::vector<const runtime::Loop*>& loops) {
    const long long releases = sum_of(loops, &runtime::LoopStatistics::releases);
    const long long overruns = sum_of(loops, &runtime::LoopStatistics::overruns);
    const std::string all =
        counted(static_cast<long long>(loops.size()), "loop") + ", " + counted(releases, "release");
    if (overruns == 0) return "every period was kept (" + all + ")";
    return counted(overruns, "OVERRUN") + " (" + all + ")";
}

std::vector<const runtime::Loop*> loops_of(const runtime::Runtime& runtime) {
    std::vector<const runtime::Loop*> loops;
    for (board::VcpuId id = 1; id <= board::kMaxLoop; ++id) {
        if (const runtime::Loop* loop = runtime.loop(id); loop && loop->declaration.body)
            loops.push_back(loop);
    }
    return loops;
}

}  // namespace qduino::apps
