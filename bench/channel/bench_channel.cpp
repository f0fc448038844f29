// bench-channel: the ring against boost::lockfree::spsc_queue, the four-slot against a mutex and a
// seqlock.
//
//   bench-channel [--json] [--rounds N] [--round-ms M]
//
// Rivals take turns within each round, so that other work on the computer hits them alike. The
// report has the mean of many short rounds. A virtual machine's two cores are near each other at
// one time and far apart at another, and a median would show either the one or the other. Queue
// figures are items received per second. Slot figures are reads and writes per second while the
// other side goes on at full speed, and how many different values the reader got.

#include <sys/resource.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "bench/channel/contenders.h"
#include "bench/channel/throughput.h"
#include "bench/rig/report.h"

namespace qduino::bench {
namespace {

struct Options {
    bool json = false;
    int rounds = 81;
    int round_ms = 12;
};

struct Row {
    std::string who;
    std::string operation;
    std::size_t payload_bytes;
    double ops_per_s;
};

constexpr std::size_t kBatch = 64;

/// Keeps the memory of the two sides apart. Otherwise they would fight over a cache line that is
/// not measured.
constexpr std::size_t kApart = 128;

/// Keeps the compiler from dropping a read whose value is not used.
template <typename T>
void keep(const T& value) {
    asm volatile("" : : "r"(&value) : "memory");
}

// ---- one measurement ----------------------------------------------------------------------------

template <typename Queue, typename T>
double items_one_by_one(CpuPair cpus, std::chrono::milliseconds duration) {
    const auto queue = std::make_unique<Queue>();
    alignas(kApart) T out{};
    alignas(kApart) T in{};
    return run_pair(
               cpus, duration, [&]() -> std::uint64_t { return ++out.words[0], queue->push(out) ? 1 : 0; },
               [&]() -> std::uint64_t {
                   const bool popped = queue->pop(in);
                   keep(in);
                   return popped ? 1 : 0;
               })
        .second_per_s;
}

template <typename Queue, typename T>
double items_in_batches(CpuPair cpus, std::chrono::milliseconds duration) {
    const auto queue = std::make_unique<Queue>();
    alignas(kApart) std::array<T, kBatch> out{};
    alignas(kApart) std::array<T, kBatch> in{};
    return run_pair(
               cpus, duration, [&]() -> std::uint64_t { return ++out[0].words[0], queue->push_some(out); },
               [&]() -> std::uint64_t {
                   const std::size_t count = queue->pop_some(in);
                   keep(in);
                   return count;
               })
        .second_per_s;
}

/// Writes and reads, or, when `fresh`, reads of a value that the reader has not seen before.
template <typename Slot, typename T>
Throughput writes_and_reads(CpuPair cpus, std::chrono::milliseconds duration, bool fresh) {
    const auto slot = std::make_unique<Slot>();
    alignas(kApart) T out{};
    alignas(kApart) T in{};
    return run_pair(
        cpus, duration, [&]() -> std::uint64_t { return ++out.words[0], slot->write(out), 1; },
        [&]() -> std::uint64_t {
            const std::uint64_t before = in.words[0];
            slot->read(in);
            keep(in);
            return !fresh || in.words[0] != before ? 1 : 0;
        });
}

// ---- all of them --------------------------------------------------------------------------------

/// Rounds of `measures`, in turn; the mean of each.
template <std::size_t N>
std::array<double, N> in_turn(int rounds,
                              const std::array<double (*)(CpuPair, std::chrono::milliseconds), N>& measures,
                              CpuPair cpus, std::chrono::milliseconds duration) {
    std::array<std::vector<double>, N> seen;
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t i = 0; i < N; ++i) seen[i].push_back(measures[i](cpus, duration));
    }
    std::array<double, N> means{};
    for (std::size_t i = 0; i < N; ++i) means[i] = mean(seen[i]);
    return means;
}

template <std::size_t Bytes>
void measure_queues(const Options& options, CpuPair cpus, std::vector<Row>& rows) {
    using T = Payload<Bytes>;
    using Ours = QduinoRing<T>;
    using Boost = BoostSpsc<T>;
    const std::chrono::milliseconds duration{options.round_ms};
    const auto single =
        in_turn<2>(options.rounds, {items_one_by_one<Ours, T>, items_one_by_one<Boost, T>}, cpus, duration);
    const auto batch =
        in_turn<2>(options.rounds, {items_in_batches<Ours, T>, items_in_batches<Boost, T>}, cpus, duration);
    rows.push_back({Ours::kName, "single", Bytes, single[0]});
    rows.push_back({Boost::kName, "single", Bytes, single[1]});
    rows.push_back({Ours::kName, "batch_64", Bytes, batch[0]});
    rows.push_back({Boost::kName, "batch_64", Bytes, batch[1]});
}

template <typename Slot, typename T>
void measure_slot(const Options& options, CpuPair cpus, std::vector<Row>& rows) {
    std::vector<double> writes, reads, fresh;
    for (int round = 0; round < options.rounds; ++round) {
        const std::chrono::milliseconds duration{options.round_ms};
        const Throughput seen = writes_and_reads<Slot, T>(cpus, duration, false);
        writes.push_back(seen.first_per_s);
        reads.push_back(seen.second_per_s);
        fresh.push_back(writes_and_reads<Slot, T>(cpus, duration, true).second_per_s);
    }
    rows.push_back({Slot::kName, "write", sizeof(T), mean(writes)});
    rows.push_back({Slot::kName, "read", sizeof(T), mean(reads)});
    rows.push_back({Slot::kName, "handed_over", sizeof(T), mean(fresh)});
}

template <std::size_t Bytes>
void measure_slots(const Options& options, CpuPair cpus, std::vector<Row>& rows) {
    using T = Payload<Bytes>;
    measure_slot<QduinoFourSlot<T>, T>(options, cpus, rows);
    measure_slot<MutexSlot<T>, T>(options, cpus, rows);
    measure_slot<Seqlock<T>, T>(options, cpus, rows);
}

// ---- report -------------------------------------------------------------------------------------

std::string guarantee(const Options& options, CpuPair cpus, bool raised) {
    const std::string where =
        cpus.first == cpus.second
            ? "both threads on CPU " + std::to_string(cpus.first) + " (the only one allowed)"
            : "threads pinned to CPUs " + std::to_string(cpus.first) + " and " + std::to_string(cpus.second);
    return where + (raised ? ", nice -20" : ", ordinary priority") + ", not isolated; mean of " +
           std::to_string(options.rounds) + " rounds of " + std::to_string(options.round_ms) + " ms in turn";
}

Report report_of(const Options& options, CpuPair cpus, bool raised, const std::vector<Row>& rows) {
    Report report;
    report.guarantee = guarantee(options, cpus, raised);
    for (const Row& row : rows) {
        report.results.push_back({{"who", row.who},
                                  {"operation", row.operation},
                                  {"payload_bytes", row.payload_bytes},
                                  {"ops_per_s", std::round(row.ops_per_s)}});
    }
    report.remarks.push_back(report.guarantee);
    return report;
}

/// A whole number > 0 after an option, or 0.
int positive(const char* text) {
    char* end = nullptr;
    const long number = text ? std::strtol(text, &end, 10) : 0;
    return text && *end == '\0' && number > 0 && number <= 100'000 ? static_cast<int>(number) : 0;
}

int usage(int status) {
    std::fprintf(
        status == 0 ? stdout : stderr,
        "usage: bench-channel [--json] [--rounds N] [--round-ms M]\n"
        "Ring buffer against boost::lockfree::spsc_queue, four-slot against a mutex and a seqlock.\n");
    return status;
}

int run(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string_view argument = argv[i];
        if (argument == "--help") return usage(0);
        if (argument == "--json") {
            options.json = true;
        } else if (argument == "--rounds" && positive(argv[i + 1]) > 0) {
            options.rounds = positive(argv[++i]);
        } else if (argument == "--round-ms" && positive(argv[i + 1]) > 0) {
            options.round_ms = positive(argv[++i]);
        } else {
            return usage(2);
        }
    }
    const CpuPair cpus = choose_cpus();
    // Ahead of other ordinary work where that is permitted. The priority ends with the process.
    const bool raised = setpriority(PRIO_PROCESS, 0, -20) == 0;
    std::vector<Row> rows;
    measure_queues<8>(options, cpus, rows);
    measure_queues<64>(options, cpus, rows);
    measure_queues<256>(options, cpus, rows);
    measure_slots<8>(options, cpus, rows);
    measure_slots<64>(options, cpus, rows);
    measure_slots<256>(options, cpus, rows);
    print(report_of(options, cpus, raised, rows), options.json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) { return qduino::bench::run(argc, argv); }
