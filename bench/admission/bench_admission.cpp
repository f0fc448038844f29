// How long admission takes for a full core: 32 loops, and 0, 8 or 31 bottom halves, at random.
//
//   bench-admission [SETS]        3000 sets of each kind without a number
//
// Each set is judged several times, and the quickest counts: the computer has other work. `judged`
// is admit_without_remedy(); `answer` is is_admissible(), which placement asks some hundred times;
// `refused` is admit() of a refused set, with its search for the smallest change.
#include <time.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "sched/admission.h"

namespace {

using namespace qduino;
using namespace qduino::sched;

constexpr int kTimes = 5;

CoreLoad random_load(std::mt19937_64& random, int ios) {
    const auto pick = [&](std::int64_t low, std::int64_t high) {
        return std::uniform_int_distribution<std::int64_t>{low, high}(random);
    };
    CoreLoad load;
    const std::int64_t percent = pick(50, 105);
    const std::int64_t io_permille = pick(5, 200);
    for (VcpuId id = 1; id <= kMainVcpuLimit; ++id) {
        const std::int64_t period = pick(1, 200) * 1'000'000 + pick(0, 999) * 1000;
        const std::int64_t budget = period * percent / 100 / static_cast<std::int64_t>(kMainVcpuLimit);
        load.mains.push_back({id, Nanoseconds{pick(budget / 2, budget)}, Nanoseconds{period}, 0});
        load.mains.back().deferrable = pick(0, 3) == 0;
    }
    for (int k = 0; k < ios; ++k) {
        const std::int64_t period = pick(10, 500) * 1'000'000;
        load.ios.push_back({static_cast<VcpuId>(33 + k), Nanoseconds{period * io_permille / 1000 / ios},
                            Nanoseconds{period}, 0, VcpuKind::io});
    }
    load.overheads.release_cost = Nanoseconds{pick(0, 3) * 1000};
    return load;
}

double now_us() {
    timespec now{};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

template <typename Work>
double quickest_us(int times, Work work) {
    double quickest = 1e18;
    for (int i = 0; i < times; ++i) {
        const double start = now_us();
        work();
        quickest = std::min(quickest, now_us() - start);
    }
    return quickest;
}

struct Figures {
    std::vector<double> us;
    [[nodiscard]] double at(double quantile) {
        if (us.empty()) return 0;
        std::sort(us.begin(), us.end());
        return us[static_cast<std::size_t>(quantile * static_cast<double>(us.size() - 1))];
    }
};

}  // namespace

int main(int count, char** arguments) {
    const int sets = count > 1 ? std::atoi(arguments[1]) : 3000;
    std::printf("32 loops, us            median      99 %%     worst    (of %d sets)\n", sets);
    for (const int ios : {0, 8, 31}) {
        std::mt19937_64 random{20261123};
        std::array<Figures, 3> figures;
        int admitted = 0;
        for (int n = 0; n < sets; ++n) {
            const CoreLoad load = random_load(random, ios);
            Admission admission;
            figures[0].us.push_back(quickest_us(kTimes, [&] { admission = admit_without_remedy(load); }));
            bool answer = false;
            figures[1].us.push_back(quickest_us(kTimes, [&] { answer = is_admissible(load); }));
            if (answer != admission.admitted) return 1;
            admitted += answer ? 1 : 0;
            if (answer || figures[2].us.size() > 50) continue;
            figures[2].us.push_back(quickest_us(2, [&] { admission = admit(load); }));
        }
        constexpr std::array<const char*, 3> kNames{"judged", "answer", "refused"};
        for (std::size_t i = 0; i < figures.size(); ++i)
            std::printf("%2d bottom halves %-8s%8.0f  %8.0f  %8.0f\n", ios, kNames[i], figures[i].at(0.5),
                        figures[i].at(0.99), figures[i].at(1));
        std::printf("%2d bottom halves        %d admitted\n", ios, admitted);
    }
    return 0;
}
