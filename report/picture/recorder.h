// Makes a schedule from what is told in order of time: by the simulator, by the kernel's tracer, by
// the critical instant.
//
//   told    runs(1) ··· taken ··· runs(2) ······· throttled(2) ··· nothing(1)
//   loop 1  ████████          ███ waits ···············  runs ████
//   loop 2  waits ················██████████████ throttled ······
//
// What lies outside the window is not kept, but a release that began within it is followed to its
// end, and the worst response is that of the whole run.
#pragma once

#include <array>
#include <map>
#include <string>

#include "report/picture/schedule.h"

namespace qduino::apps::picture {

/// One owner at a time. Instants do not run backwards from call to call, except those of taken().
class Recorder {
  public:
    /// At most so many stretches are kept; the window ends where they are used up.
    static constexpr std::size_t kStretchLimit = 500'000;

    /// Keeps what happens in [from, until).
    Recorder(Instant from, Instant until) : from_(from), until_(until) {}

    /// A VCPU is there, even when nothing is ever told of it. Contract: core >= 0.
    void declare(const sched::Vcpu& vcpu, bool owns_core);

    /// From `now` on VCPU `id` does this. A VCPU that ran there until now waits. `left`: its budget
    /// at `now`.
    void does(int core, VcpuId id, Doing doing, Instant now, Nanoseconds left = kUnknown);
    /// An interrupt or a switch takes this time of the core; the running VCPU does not get it.
    /// Contract: told in order of `from`, and before what happens after `until`.
    void taken(int core, Instant from, Instant until, const std::string& what);
    /// A release begins, due at `due`.
    void released(int core, VcpuId id, Instant at, std::optional<Instant> due);
    /// The oldest release of `id` that has not ended ended at `now`.
    void ended(VcpuId id, Instant now);
    /// The same for a release that somebody says has ended in time, without saying when: when the
    /// VCPU last came to rest. If it never did since, nobody knows when.
    void ended_in_time(VcpuId id);
    /// Each release of `id` that was due by `now` and has not ended missed its deadline.
    void missed(VcpuId id, Instant now);

    [[nodiscard]] Doing doing(VcpuId id) const {
        const auto found = vcpus_.find(id);
        return found == vcpus_.end() ? Doing::nothing : found->second.doing;
    }
    /// What was recorded up to `now`; nothing more may be told.
    [[nodiscard]] Schedule finish(Instant now);
    /// The window was cut, because more happened in it than can be kept.
    [[nodiscard]] bool cut() const { return cut_; }

  private:
    struct Vcpu {
        Row row;
        Doing doing = Doing::nothing;
        Instant since;
        Nanoseconds left = kUnknown;
        Instant idle_since = Instant::min();
    };

    Vcpu& at(int core, VcpuId id);
    void end_stretch(Vcpu& vcpu, Instant now, Nanoseconds left);
    static void end_release(Vcpu& vcpu, std::optional<Instant> end);

    Instant from_, until_;
    std::map<VcpuId, Vcpu> vcpus_;
    std::map<int, VcpuId> running_;  // by core
    std::map<int, std::vector<Taken>> taken_;
    std::size_t stretches_ = 0;
    bool cut_ = false;
};

/// "loop 1" … "loop 32", "io 33" …
[[nodiscard]] std::string row_name(VcpuId id);

}  // namespace qduino::apps::picture
