// The schedule of a run on Linux, as the kernel's tracer saw it, to draw (report/picture).
//
// Time counts from the first stretch of a loop. The kernel knows neither releases nor deadlines, so
// a wake-up stands where a release would; and it counts an interrupt's time to the thread that was
// interrupted, while the picture does not.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "report/picture/recorder.h"
#include "report/pin/pin_witness.h"

namespace qduino::apps {

/// What is known of a loop before it is traced.
struct AdmittedLoop : sched::Vcpu {
    std::optional<Nanoseconds> response;  ///< R; none: never
};

/// The loops and I/O VCPUs of an admission report (admission_json(), docs/qduino.md). Empty when
/// the file cannot be read: the picture then lacks budgets and R.
[[nodiscard]] std::vector<AdmittedLoop> admitted_loops(const std::string& path);

/// In seconds from the first stretch of a loop; what is absent is chosen.
struct TracedWindow {
    double from_s = 0;
    std::optional<double> length_s;
};

/// Told in order of time, in microseconds of any clock.
class TracedPicture {
  public:
    TracedPicture(std::string sketch, std::vector<AdmittedLoop> loops, const TracedWindow& window);

    void does(int core, sched::VcpuId vcpu, picture::Doing doing, std::int64_t us);
    /// `throttled`: it slept because its budget was spent.
    void woke(int core, sched::VcpuId vcpu, std::int64_t us, bool throttled);
    void taken(int core, std::int64_t from_us, std::int64_t until_us, const std::string& what);

    /// What was told, with R against T. It may be asked for once.
    [[nodiscard]] picture::Schedule finish();
    /// Draws that to a file, with `pins` (null: none are known) on the same clock. Error: nothing
    /// was told of any loop within the window, or the file cannot be written.
    Result<void> write(const std::string& path, const PinWitness* pins);

  private:
    [[nodiscard]] Instant at(std::int64_t us);

    std::string sketch_;
    std::vector<AdmittedLoop> loops_;
    picture::Recorder recorder_;
    bool may_choose_;  // the window's length
    std::optional<std::int64_t> start_us_;
    Instant last_ = kEpoch;
};

}  // namespace qduino::apps
