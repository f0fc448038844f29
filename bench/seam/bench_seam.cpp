// The cost of the seam: a write to a pin, a look at the clock and a busy wait that is over, through
// the Arduino face, on the Linux board with virtual pins. All three are calls of some 20 ns, so one
// indirect jump more would show.
//
//   bench-seam                        three medians, in ns a call
//   bench-seam --against PROGRAM      PROGRAM is another build of this one; both run in turn, and
//                                     their medians are compared
//
// A batch of calls lies between two looks at the clock. Nothing drains the pins meanwhile: the ring
// holds the whole run.
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <vector>

#include "arduino/Arduino.h"
#include "board/linux/linux_board.h"
#include "board/linux/pin/pins_server.h"
#include "runtime/runtime.h"
#include "terminal/command_line.h"

#undef loop
#undef round

namespace {

using namespace qduino;

constexpr int kPin = 6;
constexpr int kBatch = 256;
constexpr int kBatches = 400;  // 102400 writes: less than a ring holds
constexpr std::array<const char*, 3> kNames{"pin_write", "now", "busy_until"};

using Medians = std::array<double, 3>;

double median(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

std::array<std::vector<double>, 3> taken;

template <typename Call>
void measure(std::vector<double>& into, Call call) {
    const unsigned long long start = nanos();
    for (int i = 0; i < kBatch; ++i) call(i);
    into.push_back(static_cast<double>(nanos() - start) / kBatch);
}

void body() {
    for (auto& values : taken) values.reserve(kBatches);
    for (int batch = 0; batch < kBatches; ++batch) {
        measure(taken[0], [](int i) { digitalWrite(kPin, i & 1); });
        measure(taken[1], [](int) { static_cast<void>(timeNow()); });
        const Instant past = timeNow();
        measure(taken[2], [past](int) { delayBusyUntil(past); });
    }
    stopSketch();
}

bool measure_once(Medians& medians) {
    const std::string path = "/dev/shm/qduino-bench-" + std::to_string(::getpid()) + ".pins";
    auto server = board::linux::PinsServer::create(path);
    if (!server) return false;
    board::linux::LinuxConfig config;
    config.pins_path = path;
    config.real_time = false;
    auto board = board::linux::LinuxBoard::open(config);
    ::unlink(path.c_str());
    if (!board) return false;
    runtime::Runtime runtime(**board);
    runtime::SketchTable table;
    table.setup = [] { pinMode(kPin, OUTPUT); };
    table.loops.push_back(
        {{.id = 1, .budget = 100ms, .period = 100ms, .core = (*board)->core_count() - 1}, &body});
    if (!runtime.begin(table)) return false;
    runtime.run(kForever);
    for (std::size_t i = 0; i < medians.size(); ++i) medians[i] = median(taken[i]);
    return (*board)->lost_edges() == 0;
}

/// The three numbers that a run of `program` prints.
bool run_program(const std::string& program, std::array<std::vector<double>, 3>& into) {
    std::FILE* const output = ::popen((program + " --bare").c_str(), "r");
    Medians medians{};
    const bool read =
        output && std::fscanf(output, "%lf %lf %lf", &medians[0], &medians[1], &medians[2]) == 3;
    if (output) ::pclose(output);
    for (std::size_t i = 0; read && i < medians.size(); ++i) into[i].push_back(medians[i]);
    return read;
}

int compare(const std::string& self, const std::string& other, int rounds) {
    std::array<std::vector<double>, 3> ours, theirs;
    for (int i = 0; i < rounds; ++i) {
        if (!run_program(self, ours) || !run_program(other, theirs)) return 1;
    }
    std::printf("%-12s %14s %14s   (ns a call, median of %d runs in turn)\n", "", "this", "the other",
                rounds);
    for (std::size_t i = 0; i < kNames.size(); ++i)
        std::printf("%-12s %14.2f %14.2f\n", kNames[i], median(ours[i]), median(theirs[i]));
    return 0;
}

}  // namespace

int main(int argc, char** argv) {
    qduino::apps::CommandLine line{
        "What a write to a pin, a look at the clock and a busy wait cost through the Arduino face."};
    std::string other;
    int rounds = 20;
    bool bare = false;
    line.option("--against", other, "Another build of this program: run in turn with this one")
        .called("PROGRAM");
    line.option("--rounds", rounds, "Runs of each").within(1, 1000);
    line.flag("--bare", bare, "The three numbers alone");
    if (const auto status = line.parse(argc, argv)) return *status;
    ::setpriority(PRIO_PROCESS, 0, -20);
    if (!other.empty()) return compare(argv[0], other, rounds);
    Medians medians{};
    if (!measure_once(medians))
        return std::fputs("bench-seam: no virtual pins to be had in /dev/shm\n", stderr), 1;
    for (std::size_t i = 0; i < medians.size(); ++i)
        bare ? std::printf("%.3f ", medians[i]) : std::printf("%-12s %8.2f ns\n", kNames[i], medians[i]);
    return 0;
}
