#include "board/linux/computer/overheads.h"

#include <fcntl.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>

#include "board/linux/kernel/bare_spin.h"
#include "board/linux/kernel/control_groups.h"
#include "board/linux/kernel/kernel_text.h"
#include "board/linux/kernel/real_time_thread.h"
#include "posix/unique_fd.h"
#include "sched/budget_watch.h"

namespace qduino::board::linux {

namespace {

constexpr std::size_t kSamples = 33;
using posix::UniqueFd;
using Samples = std::array<Nanoseconds, kSamples>;

Nanoseconds median(Samples& samples) {
    std::nth_element(samples.begin(), samples.begin() + kSamples / 2, samples.end());
    return samples[kSamples / 2];
}

/// Batches of samples, and a pause before each further one, while all have been slow.
constexpr int kBatches = 3, kBatchesOfSlow = 12;
constexpr Nanoseconds kSlow = 200us, kPause = 10ms;

/// The least of some medians. A host that takes the core away makes most samples of a batch long;
/// what it takes is counted once already, as an interrupt (interference.h).
template <typename Measure>
Nanoseconds least_of(Measure measure) {
    Nanoseconds least = measure();
    for (int batch = 1; batch < (least > kSlow ? kBatchesOfSlow : kBatches); ++batch) {
        if (least > kSlow) block_until(monotonic_now() + kPause);
        least = std::min(least, measure());
    }
    return least;
}

/// CPU time of going to sleep and waking up again.
Nanoseconds sleep_cost() {
    Samples samples;
    for (Nanoseconds& sample : samples) {
        const Nanoseconds before = thread_cpu_time();
        block_until(monotonic_now() + 100us);
        sample = thread_cpu_time() - before;
    }
    return median(samples);
}

extern "C" void on_sample(int) {}

/// The gap in a spin that a timer's signal to the thread itself makes.
Nanoseconds signal_cost() {
    const int signal = SIGRTMIN + 4;
    struct sigaction action {};
    struct sigaction before {};
    action.sa_handler = on_sample;
    sigemptyset(&action.sa_mask);
    ::sigaction(signal, &action, &before);
    Samples samples{};
    if (const auto timer = make_thread_timer(signal)) {
        for (Nanoseconds& sample : samples) {
            itimerspec soon{};
            soon.it_value.tv_nsec = 30'000;
            ::timer_settime(*timer, 0, &soon, nullptr);
            spin_and_look(100us, [&sample](Nanoseconds between) { sample = std::max(sample, between); });
        }
        ::timer_delete(*timer);
    }
    ::sigaction(signal, &before, nullptr);
    return median(samples);
}

}  // namespace

sched::PlatformOverheads measure_overheads() {
    sched::PlatformOverheads overheads;
    overheads.release_cost = least_of(sleep_cost);
    // The sleep in the handler is charged, or the one of its period.
    overheads.enforcement_cost = least_of(signal_cost);
    return overheads;
}

namespace {

double kernel_number(const std::string& root, const char* name) {
    return std::strtod(text_of_file(root + "/proc/sys/kernel/" + name).c_str(), nullptr);
}

}  // namespace

void keep_for_ordinary_tasks(sched::PlatformOverheads& overheads, const std::string& root) {
    const double runtime_us = kernel_number(root, "sched_rt_runtime_us");
    const double period_us = kernel_number(root, "sched_rt_period_us");
    double share = 1;
    if (runtime_us >= 0 && period_us > runtime_us) {
        overheads.kept_period = from_seconds(period_us * 1e-6);
        overheads.kept_budget = from_seconds((period_us - runtime_us) * 1e-6);
        share = runtime_us / period_us;
    }
    // A group with nothing takes no real-time task, so there is nothing to be admitted.
    const auto group = real_time_group(root);
    if (!group || group->runtime <= Nanoseconds{0}) return;
    if (group->share() >= share) return;
    overheads.kept_period = group->period;
    overheads.kept_budget = group->period - group->runtime;
    overheads.kept_by = "control group's limit";
}

sched::PlatformInterferer warden_looks(Nanoseconds wait) {
    constexpr int kLoops = 8;  // that are due at one look
    const UniqueFd times{::open("/proc/thread-self/schedstat", O_RDONLY | O_CLOEXEC)};
    const auto look = [&times] {
        Samples samples;
        for (Nanoseconds& sample : samples) {
            std::array<char, 128> text;
            const Nanoseconds before = thread_cpu_time();
            for (int i = 0; i < kLoops; ++i)
                static_cast<void>(!::pread(times.get(), text.data(), text.size(), 0));
            sample = thread_cpu_time() - before;
        }
        return median(samples);
    };
    return {
        .name = "warden", .cost = wait + least_of(look), .interval = sched::BudgetWatch::kTick, .jitter = {}};
}

double real_time_share(const std::string& root) {
    constexpr double kShareOfMargin = 0.03;
    const double runtime_us = kernel_number(root, "sched_rt_runtime_us");
    const double period_us = kernel_number(root, "sched_rt_period_us");
    const bool limited = runtime_us >= 0 && period_us > runtime_us;
    double share = limited ? runtime_us / period_us : 1;
    if (const auto group = real_time_group(root)) share = std::min(share, group->share());
    return share >= 1 ? 1 : std::max(0.1, share - kShareOfMargin);
}

}  // namespace qduino::board::linux
