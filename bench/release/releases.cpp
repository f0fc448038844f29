#include "bench/release/releases.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "apps/host/bind_linux.h"
#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/samples.h"
#include "board/linux/real_time_thread.h"

namespace qduino::bench {
namespace {

using namespace board::linux;

/// Releases at the start that are left out: caches, and the way out of the start gate.
constexpr std::size_t kWarmUp = 100;
constexpr board::VcpuId kLoop = 1;

runtime::Runtime<LinuxBoard>* measured = nullptr;
SharedSamples* samples = nullptr;
SharedSamples* first_due = nullptr;  // one: an instant at which the loop was due

/// The body of the loop: writes down how late it is, and waits.
void body() {
    const Instant due = measured->loop(kLoop)->clock.nominal();
    samples->push((measured->board().now() - due).count());
    first_due->push(to_ns(due));
    measured->wait_for_next_period();
}

int play_qduino(Nanoseconds length, const GuaranteeFile& guarantee) {
    auto opened = LinuxBoard::open({});
    if (!opened) return 1;
    LinuxBoard& board = *opened.value();
    runtime::Runtime<LinuxBoard> runtime{board};
    port::bind(&runtime);
    measured = &runtime;
    runtime::SketchTable table;
    table.loops.push_back({.id = kLoop,
                           .budget = kReleaseBudget,
                           .period = kReleasePeriod,
                           .core = board.core_count() - 1,
                           .body = &body,
                           .file = __FILE__,
                           .line = __LINE__});
    if (!runtime.begin(table)) return 1;
    guarantee.write(board.guarantee());
    runtime.run(board.now() + length);
    board.request_stop();
    runtime.run(board.now() + 1s);
    port::bind(nullptr);
    return 0;
}

/// cyclictest -v prints "task: count: latency", in nanoseconds with -N.
std::vector<std::int64_t> latencies_in(const std::string& path) {
    std::vector<std::int64_t> latencies;
    std::ifstream file{path};
    for (std::string line; std::getline(file, line);) {
        long task = 0, count = 0, latency = 0;
        if (std::sscanf(line.c_str(), " %ld: %ld: %ld", &task, &count, &latency) == 3)
            latencies.push_back(latency);
    }
    return latencies;
}

void drop_warm_up(Releases& releases) {
    auto& all = releases.latencies_ns;
    all.erase(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(std::min(kWarmUp, all.size())));
    if (all.empty() && releases.failure.empty()) releases.failure = "no releases were seen";
}

}  // namespace

Releases run_qduino(Nanoseconds length) {
    SharedSamples taken{static_cast<std::size_t>(length / kReleasePeriod) + 1000};
    SharedSamples due{1};
    samples = &taken;
    first_due = &due;
    const GuaranteeFile guarantee;
    Releases releases;
    releases.failure = run_child([&] { return play_qduino(length, guarantee); }, length + 5s);
    releases.latencies_ns = taken.taken();
    for (const std::int64_t instant : due.taken()) releases.phase = Nanoseconds{instant} % kReleasePeriod;
    releases.guarantee = guarantee.read();
    drop_warm_up(releases);
    return releases;
}

Releases run_cyclictest(Nanoseconds length, Nanoseconds phase) {
    const std::string output = "/dev/shm/qduino-bench-" + std::to_string(::getpid()) + ".cyclictest";
    const auto start = [&] {
        ::dup2(::open(output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644), STDOUT_FILENO);
        const std::string priority = "-p" + std::to_string(kReleasePriority);
        const std::string interval = "-i" + std::to_string(kReleasePeriod.count() / 1000);
        const std::string core = "-a" + std::to_string(cpu_count() - 1);
        const std::string loops = "-l" + std::to_string(length / kReleasePeriod);
        const std::string aligned = "--secaligned=" + std::to_string(phase.count() / 1000);
        ::execlp("cyclictest", "cyclictest", "-t1", "-m", "-N", "-v", priority.c_str(), interval.c_str(),
                 core.c_str(), loops.c_str(), aligned.c_str(), nullptr);
        return 127;
    };
    Releases releases;
    releases.failure = run_child(start, length + 5s);
    if (releases.failure == "ended with status 127")
        releases.failure = "cyclictest is not installed (apt-get install rt-tests)";
    releases.latencies_ns = latencies_in(output);
    std::filesystem::remove(output);
    drop_warm_up(releases);
    return releases;
}

}  // namespace qduino::bench
