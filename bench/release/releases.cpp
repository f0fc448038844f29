#include "bench/release/releases.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "bench/rig/child.h"
#include "bench/rig/guarantee_file.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/linux_board.h"
#include "runtime/runtime.h"

namespace qduino::bench {
namespace {

using namespace board::linux;

/// Releases at the start that are left out: caches, and the way out of the start gate.
constexpr std::size_t kWarmUp = 100;
/// The time for cyclictest to start, which waits for a whole second, and to write its results.
constexpr Nanoseconds kStartUp = 6s;
constexpr board::VcpuId kLoop = 1;

/// Shared by our loop and its parent.
struct Exchange {
    explicit Exchange(Nanoseconds longest) : latencies(static_cast<std::size_t>(longest / kReleasePeriod)) {}
    SharedSamples latencies;
    SharedSamples first_due{1};  ///< an instant at which the loop was due
    SharedSamples enough{1};     ///< not empty: ours may end
};

runtime::Runtime* measured = nullptr;
Exchange* exchange = nullptr;

/// The body of the loop: notes how late it is, and waits.
void body() {
    const Instant due = measured->loop(kLoop)->clock.nominal();
    exchange->latencies.push((measured->board().now() - due).count());
    exchange->first_due.push(to_ns(due));
    measured->wait_for_next_period();
}

int play_qduino(Nanoseconds length, const GuaranteeFile& guarantee) {
    auto opened = LinuxBoard::open({});
    if (!opened) return cannot(opened.error());
    LinuxBoard& board = *opened.value();
    runtime::Runtime runtime{board};
    measured = &runtime;
    runtime::SketchTable table;
    table.loops.push_back(
        {{kLoop, kReleaseBudget, kReleasePeriod, board.core_count() - 1}, &body, __FILE__, __LINE__});
    if (const auto begun = runtime.begin(table); !begun) return cannot(begun.error());
    guarantee.write(board.guarantee());
    const Instant end = board.now() + length;
    while (!exchange->enough.full() && board.now() < end) runtime.run(board.now() + 20ms);
    board.request_stop();
    runtime.run(board.now() + 1s);
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

/// `phase`: the place of its due instants within their period.
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
    releases.failure = run_child(start, length + kStartUp);
    if (releases.failure == "ended with status 127")
        releases.failure = "cyclictest is not installed (apt-get install rt-tests)";
    releases.latencies_ns = latencies_in(output);
    std::filesystem::remove(output);
    return releases;
}

/// Keeps the samples from `from` to `to` without the warm-up.
void keep(Releases& releases, std::size_t from, std::size_t to) {
    auto& all = releases.latencies_ns;
    const auto at = [&](std::size_t i) {
        return all.begin() + static_cast<std::ptrdiff_t>(std::min(i, all.size()));
    };
    all.erase(at(to), all.end());
    all.erase(all.begin(), at(from + kWarmUp));
    if (all.empty() && releases.failure.empty()) releases.failure = "no releases were seen";
}

}  // namespace

Contenders run_both(Nanoseconds length) {
    const Nanoseconds longest = length + kStartUp;
    Exchange shared{longest};
    exchange = &shared;
    const GuaranteeFile guarantee;
    Contenders both;
    bool rival_ran = false;
    std::size_t from = 0;
    std::size_t to = SIZE_MAX;
    const auto rival = [&] {
        if (rival_ran || !shared.first_due.full()) return;
        rival_ran = true;
        const Nanoseconds apart = Nanoseconds{shared.first_due.taken().front()} + kReleasePeriod / 2;
        both.cyclictest = run_cyclictest(length, apart % kReleasePeriod);
        if (!both.cyclictest.failure.empty()) return;
        to = shared.latencies.taken().size();
        from = to - std::min(to, static_cast<std::size_t>(length / kReleasePeriod));
        shared.enough.push(1);
    };
    both.qduino.failure = run_child([&] { return play_qduino(length + 2s, guarantee); }, longest, rival);
    both.qduino.latencies_ns = shared.latencies.taken();
    both.qduino.guarantee = guarantee.read();
    keep(both.qduino, from, to);
    keep(both.cyclictest, 0, SIZE_MAX);
    return both;
}

}  // namespace qduino::bench
