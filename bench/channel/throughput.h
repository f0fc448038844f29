// Two threads, pinned apart, do one thing each for a while. Counts how often each did it, per
// second.
#pragma once

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <numeric>
#include <thread>
#include <vector>

namespace qduino::bench {

/// The two CPUs of this process for the two sides; the same one twice when it has only one.
struct CpuPair {
    int first = 0;
    int second = 0;
};

inline CpuPair choose_cpus() {
    cpu_set_t allowed;
    CPU_ZERO(&allowed);
    sched_getaffinity(0, sizeof allowed, &allowed);
    std::vector<int> cpus;
    for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
        if (CPU_ISSET(cpu, &allowed)) cpus.push_back(cpu);
    }
    return cpus.empty() ? CpuPair{} : CpuPair{cpus.front(), cpus.back()};
}

inline void pin_to(int cpu) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    pthread_setaffinity_np(pthread_self(), sizeof one, &one);
}

struct Throughput {
    double first_per_s = 0;
    double second_per_s = 0;
};

/// `first()` and `second()` return how many operations they did; 0 when they could not (full,
/// empty). They are then tried again. After many failures the thread yields, for a computer with
/// fewer free CPUs than threads.
template <typename First, typename Second>
Throughput run_pair(CpuPair cpus, std::chrono::milliseconds duration, First first, Second second) {
    std::atomic<int> ready{0};
    std::atomic<bool> stop{false};
    const auto side = [&](int cpu, auto& operation, double& per_s) {
        pin_to(cpu);
        ready.fetch_add(1);
        while (ready.load() < 2) std::this_thread::yield();
        const auto begin = std::chrono::steady_clock::now();
        std::uint64_t done = 0;
        int failures = 0;
        while (!stop.load(std::memory_order_relaxed)) {
            for (int i = 0; i < 64; ++i) {
                const std::uint64_t count = operation();
                done += count;
                failures = count > 0 ? 0 : failures + 1;
            }
            if (failures > 4096) std::this_thread::yield(), failures = 0;
        }
        const std::chrono::duration<double> passed = std::chrono::steady_clock::now() - begin;
        per_s = static_cast<double>(done) / passed.count();
    };
    Throughput result;
    std::thread a{[&] { side(cpus.first, first, result.first_per_s); }};
    std::thread b{[&] { side(cpus.second, second, result.second_per_s); }};
    while (ready.load() < 2) std::this_thread::yield();
    std::this_thread::sleep_for(duration);
    stop.store(true);
    a.join();
    b.join();
    return result;
}

inline double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) /
           static_cast<double>(std::max<std::size_t>(values.size(), 1));
}

}  // namespace qduino::bench
