#include "report/picture/critical_instant.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "sched/core_scheduler.h"

namespace qduino::apps::picture {
namespace {

struct Loop {
    sched::Vcpu vcpu;
    Instant next_release = kEpoch;
    Nanoseconds wanted{};    // CPU time until all its releases are done
    Nanoseconds of_first{};  // of which the oldest release still wants
    Nanoseconds overhead{};  // that its next activation costs the core
    Doing doing = Doing::nothing;
};

struct Source {
    sched::PlatformInterferer interferer;
    Instant next = kEpoch;
    bool came = false;
};

class CriticalCore {
  public:
    CriticalCore(const sched::PlatformOverheads& overheads, VcpuId owner, Recorder& recorder)
        : overheads_(overheads), owner_(owner), recorder_(recorder) {
        for (const sched::PlatformInterferer& interferer : overheads.interferers) {
            if (interferer.cost > Nanoseconds{0}) sources_.push_back({.interferer = interferer});
        }
    }

    void add(const sched::Vcpu& vcpu) {
        const bool owns = vcpu.id == owner_;
        const bool added = vcpu.is_io()
                               ? scheduler_.add_io(vcpu.id, vcpu.parameters())
                               : scheduler_.add(vcpu.id, vcpu.parameters(), kEpoch, {.owns_core = owns});
        if (!added) return;
        recorder_.declare(vcpu, owns);
        loops_.push_back({.vcpu = vcpu});
    }

    void play(Instant until) {
        while (now_ < until && !recorder_.cut()) {
            release();
            interrupt();
            if (taken_until_ > now_) {
                pass_taken(std::min(taken_until_, until));
            } else {
                run(until);
            }
        }
        for (const Loop& loop : loops_) recorder_.missed(loop.vcpu.id, now_);
    }

  private:
    void release() {
        for (Loop& loop : loops_) {
            if (loop.next_release > now_) continue;
            if (loop.vcpu.is_io()) {
                scheduler_.wake_io(loop.vcpu.id, now_, client_period(loop.vcpu));
            } else if (loop.wanted == Nanoseconds{0}) {
                scheduler_.wake(loop.vcpu.id, now_);
            }
            if (loop.wanted == Nanoseconds{0}) {
                loop.overhead = overheads_.per_activation();
                loop.of_first = loop.vcpu.budget;
            }
            if (loop.vcpu.is_io()) {
                loop.wanted = Nanoseconds::max();
                loop.next_release = kForever;
                recorder_.released(loop.vcpu.core, loop.vcpu.id, now_, std::nullopt);
                continue;
            }
            recorder_.missed(loop.vcpu.id, now_);
            loop.wanted += loop.vcpu.budget;
            loop.next_release += loop.vcpu.period;
            recorder_.released(loop.vcpu.core, loop.vcpu.id, now_, loop.next_release);
        }
    }

    /// As boards have it: the one that it names, or the shortest of its core.
    [[nodiscard]] Nanoseconds client_period(const sched::Vcpu& io) const {
        if (io.client_period > Nanoseconds{0}) return io.client_period;
        Nanoseconds shortest = Nanoseconds::max();
        for (const Loop& loop : loops_) {
            if (!loop.vcpu.is_io()) shortest = std::min(shortest, loop.vcpu.period);
        }
        return shortest == Nanoseconds::max() ? io.period : shortest;
    }

    void interrupt() {
        for (Source& source : sources_) {
            while (source.next <= now_) {
                take(source.interferer.cost, std::string(source.interferer.name.view()));
                const Nanoseconds early = source.came ? Nanoseconds{0} : source.interferer.jitter;
                source.came = true;
                source.next += std::max(source.interferer.interval - early, Nanoseconds{1});
            }
        }
    }

    void take(Nanoseconds cost, const std::string& what) {
        const Instant from = std::max(now_, taken_until_);
        taken_until_ = from + cost;
        if (!loops_.empty()) recorder_.taken(loops_.front().vcpu.core, from, taken_until_, what);
    }

    void pass_taken(Instant until) {
        const Instant next = std::min(until, next_event());
        scheduler_.account(next, next - now_);
        now_ = next;
        tell();
    }

    void run(Instant until) {
        const sched::Decision decision = scheduler_.decide(now_);
        Loop* const chosen = decision.vcpu ? &*std::ranges::find(loops_, *decision.vcpu,
                                                                 [](const Loop& l) { return l.vcpu.id; })
                                           : nullptr;
        running_ = chosen;
        tell();
        if (chosen && chosen->overhead > Nanoseconds{0}) {
            take(std::exchange(chosen->overhead, Nanoseconds{0}), "release and enforcement");
            return;
        }
        Instant next = std::min({until, decision.until, next_event()});
        if (chosen && chosen->wanted < kForever - now_) next = std::min(next, now_ + chosen->of_first);
        next = std::max(next, now_ + Nanoseconds{1});
        scheduler_.account(next);
        if (chosen) consume(*chosen, next - now_, next);
        now_ = next;
    }

    void consume(Loop& loop, Nanoseconds used, Instant now) {
        if (loop.vcpu.is_io()) return;
        loop.wanted -= used;
        loop.of_first -= used;
        if (loop.of_first > Nanoseconds{0}) return;
        recorder_.ended(loop.vcpu.id, now);
        loop.of_first = loop.vcpu.budget;
        if (loop.wanted > Nanoseconds{0}) return;
        scheduler_.block(loop.vcpu.id, now);
        if (running_ == &loop) running_ = nullptr;
        tell(now);
    }

    [[nodiscard]] Instant next_event() const {
        Instant next = kForever;
        for (const Loop& loop : loops_) next = std::min(next, loop.next_release);
        for (const Source& source : sources_) next = std::min(next, source.next);
        return next;
    }

    void tell() { tell(now_); }
    void tell(Instant now) {
        for (Loop& loop : loops_) {
            const Nanoseconds left =
                loop.vcpu.id == owner_ ? kUnknown : scheduler_.available(loop.vcpu.id, now);
            const Doing doing = loop.wanted == Nanoseconds{0} ? Doing::nothing
                                : &loop == running_           ? Doing::runs
                                : left == Nanoseconds{0}      ? Doing::throttled
                                                              : Doing::waits;
            if (doing == loop.doing) continue;
            loop.doing = doing;
            recorder_.does(loop.vcpu.core, loop.vcpu.id, doing, now, left);
        }
    }

    const sched::PlatformOverheads& overheads_;
    VcpuId owner_;
    Recorder& recorder_;
    sched::CoreScheduler scheduler_;
    std::vector<Loop> loops_;
    std::vector<Source> sources_;
    Loop* running_ = nullptr;
    Instant now_ = kEpoch;
    Instant taken_until_ = kEpoch;
};

}  // namespace

void record_critical_instant(std::span<const sched::Vcpu> vcpus, const sched::PlatformOverheads& overheads,
                             VcpuId owner, Instant until, Recorder& recorder) {
    CriticalCore core(overheads, owner, recorder);
    for (const sched::Vcpu& vcpu : vcpus) core.add(vcpu);
    core.play(until);
}

}  // namespace qduino::apps::picture
