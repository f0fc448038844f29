// The default VCPU of the paper (RTAS 2017, section IV), for the print service: 10 ms in 100 ms on
// core 0, below every loop of the sketch.
//
// How much fits there is known only when the loops run: it depends on the interrupts that admission
// has to count on this computer. A default that fails its own admission is no promise. So the
// service asks for 10 ms and takes what fits, from kServiceLeast on. A budget that a person asked
// for is not changed; when it does not surely fit, that is said.
//
// Where no control group can be made, or the budget was lifted, the service is an ordinary process,
// and that is said with the reason. The service itself knows nothing of this, and has no right to
// change it; it shows the page what stands in the file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/time.h"
#include "board/guarantee.h"
#include "board/linux/kernel/cpu_group.h"
#include "vcpu/process_vcpu.h"

namespace qduino::launcher {

inline constexpr Nanoseconds kServiceBudget = 10ms;
/// With less, a page takes seconds: then it keeps what was asked for, and says that it is not sure.
inline constexpr Nanoseconds kServiceLeast = 2ms;
inline constexpr Nanoseconds kServicePeriod = 100ms;
inline constexpr int kServiceCore = 0;

class ServiceVcpu {
  public:
    /// `why_none` is said when there is no `budget`. `exactly`: a person asked for this budget.
    /// `file` is where the page's copy is written. From a process with one thread.
    ServiceVcpu(std::optional<Nanoseconds> budget, bool exactly, const std::string& why_none,
                std::filesystem::path file);

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    /// In the service's process, before it becomes the program.
    void enter() const;
    /// Admits it beside the loops that run by now, with what fits, and writes the file.
    void admit_again();
    /// Writes the file anew now and then. `lives`: a service runs.
    void look(Instant now, bool lives);
    /// What holds, for the report.
    [[nodiscard]] std::string words() const;
    /// The same for one line of the first screen: "web budget 7 of 100 ms (10 asked, 7 fit)".
    [[nodiscard]] std::string in_a_line() const;

  private:
    [[nodiscard]] board::TreeGuarantee guarantee() const;
    void fit();
    void write(Instant now);

    std::filesystem::path file_;
    std::optional<apps::ProcessVcpu> vcpu_;
    std::string why_none_;
    Nanoseconds asked_{};
    bool exactly_ = false;
    bool outside_ = false;  // a service runs, and is not in its group
    Instant started_{}, written_at_{};
    board::linux::CpuGroupUse use_;  // as of written_at_
};

}  // namespace qduino::launcher
