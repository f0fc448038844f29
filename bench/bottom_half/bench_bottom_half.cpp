// bench-bottom-half: which server suits a bottom half? 8000 interrupts a second, each with a little
// deferred work, once on a sporadic server (SS) and once on PIBS, the same budget in the same
// period, by the scheduler of both boards (sched/core_scheduler.h).
//
//   bench-bottom-half [--json] [--switch US]
//
//   interrupts   ╵  ╵  ╵  ╵  ╵  ╵  ╵  ╵       8 kHz, the gaps uniform in 62.5 … 187.5 us
//   bottom half  █  █  █  █  ░  ░  █  ░       1 in 5 ms, for a loop of 5 ms
//   loop          ██ ██ ██ ██████████ █       40 in 100 ms, would run for ever
//
// A sporadic server remembers each short service as a refill of its own, so a bottom half comes
// back in splinters. PIBS has one replenishment. (E. Missimer, K. Zhao, R. West,
// "Mixed-criticality scheduling with I/O", ECRTS 2016, section V, is the experiment that this one
// follows.) Time is virtual, so each figure but `decision_ns` is the same on every computer.
// `decision_ns` is the computer's time for one decision of the scheduler.
#include <algorithm>
#include <cstdio>
#include <deque>
#include <random>

#include "bench/rig/report.h"
#include "bench/rig/samples.h"
#include "board/linux/kernel/clock.h"
#include "sched/core_scheduler.h"
#include "terminal/command_line.h"

namespace qduino::bench {
namespace {

using sched::CoreScheduler;
using sched::Decision;
using sched::VcpuId;

constexpr VcpuId kLoop = 1, kBottomHalf = 33;
constexpr sched::VcpuParameters kServed{1ms, 5ms};
constexpr Nanoseconds kLength = 20s;

enum class ServerKind : std::uint8_t { sporadic, pibs };

struct Outcome {
    std::vector<std::int64_t> latencies_ns;  ///< from an interrupt to the end of its bottom half
    std::int64_t switches = 0;               ///< of the core, from one VCPU to another
    std::int64_t alarms = 0;                 ///< the core's one-shot timer was set anew
    std::size_t refills = 0;                 ///< the most at one time
    Nanoseconds served{}, loop{};            ///< work done; what switches took is neither's
    double decision_ns = 0;
};

/// One core in virtual time.
class Core {
  public:
    Core(ServerKind kind, Nanoseconds work, Nanoseconds switch_cost)
        : work_(work), switch_cost_(switch_cost) {
        bool added = scheduler_.add(kLoop, {40ms, 100ms});
        added &= kind == ServerKind::pibs ? scheduler_.add_io(kBottomHalf, kServed)
                                          : scheduler_.add(kBottomHalf, kServed);
        QDUINO_EXPECT(added);
    }

    Outcome run() {
        scheduler_.wake(kLoop, now_);
        const Instant begin = board::linux::monotonic_now();
        std::int64_t decisions = 0;
        for (; now_ < kEpoch + kLength; ++decisions) step();
        outcome_.decision_ns = static_cast<double>((board::linux::monotonic_now() - begin).count()) /
                               static_cast<double>(decisions);
        return std::move(outcome_);
    }

  private:
    /// Goes from one decision to the next.
    void step() {
        const Decision decision = scheduler_.decide(now_);
        note(decision);
        Instant until = std::min(decision.until, next_interrupt_);
        if (running_ == kBottomHalf) until = std::min(until, now_ + to_switch_ + left_);
        work_until(std::max(until, now_));
        if (now_ >= next_interrupt_) interrupt();
    }

    void note(const Decision& decision) {
        const VcpuId chosen = decision.vcpu.value_or(0);
        if (chosen != running_ && chosen != 0) {
            ++outcome_.switches;
            to_switch_ = switch_cost_;
        }
        running_ = chosen;
        if (decision.until != alarm_ && decision.until != kForever) ++outcome_.alarms;
        alarm_ = decision.until;
        const auto refills = scheduler_.server(kBottomHalf).refills().size();
        outcome_.refills = std::max(outcome_.refills, std::max<std::size_t>(refills, 1));
    }

    void work_until(Instant until) {
        Nanoseconds length = until - now_;
        const Nanoseconds switching = std::min(length, to_switch_);
        if (running_ != 0) to_switch_ -= switching;
        length -= switching;
        now_ = until;
        if (running_ == kLoop) outcome_.loop += length;
        if (running_ != kBottomHalf) return;
        outcome_.served += length;
        left_ -= length;
        if (left_ > Nanoseconds{0}) return;
        outcome_.latencies_ns.push_back((now_ - waiting_.front()).count());
        waiting_.pop_front();
        left_ = waiting_.empty() ? Nanoseconds{0} : work_;
        if (waiting_.empty()) scheduler_.block(kBottomHalf, now_);
    }

    void interrupt() {
        waiting_.push_back(now_);
        if (waiting_.size() == 1) {
            left_ = work_;
            scheduler_.wake(kBottomHalf, now_);
        }
        next_interrupt_ = now_ + Nanoseconds{gap_(random_)};
    }

    CoreScheduler scheduler_;
    Nanoseconds work_, switch_cost_;
    std::mt19937_64 random_{1};
    std::uniform_int_distribution<std::int64_t> gap_{62'500, 187'500};
    Instant now_ = kEpoch, next_interrupt_ = kEpoch, alarm_ = kForever;
    std::deque<Instant> waiting_;  // interrupts that are not served
    Nanoseconds left_{};           // of the first of them
    Nanoseconds to_switch_{};      // before the running VCPU gets on
    VcpuId running_ = 0;
    Outcome outcome_;
};

double per_second(std::int64_t count) { return static_cast<double>(count) / to_seconds(kLength); }

Json row(const char* name, Nanoseconds work, Outcome& seen) {
    std::sort(seen.latencies_ns.begin(), seen.latencies_ns.end());
    const auto latency_us = [&](double q) {
        return static_cast<double>(percentile(seen.latencies_ns, q)) / 1000;
    };
    const auto share = [](Nanoseconds time) { return to_seconds(time) / to_seconds(kLength); };
    return {{"server", name},
            {"work_us", work.count() / 1000},
            {"served_per_s", per_second(static_cast<std::int64_t>(seen.latencies_ns.size()))},
            {"switches_per_s", per_second(seen.switches)},
            {"alarms_per_s", per_second(seen.alarms)},
            {"refills", seen.refills},
            {"latency_us_p50", latency_us(0.5)},
            {"latency_us_p99", latency_us(0.99)},
            {"served_share", share(seen.served)},
            {"loop_share", share(seen.loop)},
            {"decision_ns", seen.decision_ns}};
}

int run(bool json, double switch_us) {
    Report report;
    report.guarantee = "virtual time; a switch between VCPUs takes " + std::to_string(switch_us) + " us";
    const Nanoseconds switch_cost = from_seconds(switch_us / 1e6);
    for (const Nanoseconds work :
         {Nanoseconds{5us}, Nanoseconds{10us}, Nanoseconds{20us}, Nanoseconds{40us}}) {
        Outcome sporadic = Core{ServerKind::sporadic, work, switch_cost}.run();
        Outcome pibs = Core{ServerKind::pibs, work, switch_cost}.run();
        report.results.push_back(row("sporadic", work, sporadic));
        report.results.push_back(row("pibs", work, pibs));
    }
    print(report, json);
    return 0;
}

}  // namespace
}  // namespace qduino::bench

int main(int argc, char** argv) {
    qduino::apps::CommandLine line{
        "Bottom halves of 8000 interrupts a second: a sporadic server against PIBS.",
        "Example: bench-bottom-half --json > bottom_half.json"};
    bool json = false;
    double switch_us = 2;
    line.flag("--json", json, "one JSON object");
    line.option("--switch", switch_us, "what a switch from one VCPU to another takes, in us")
        .within(0.0, 50.0);
    if (const auto status = line.parse(argc, argv)) return *status;
    return qduino::bench::run(json, switch_us);
}
