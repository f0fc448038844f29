// The default VCPU of the paper (RTAS 2017, section IV), for the print service: 10 ms in 100 ms on
// core 0, below every loop of the sketch.
//
// Where no control group can be made, or the budget was lifted, the service is an ordinary process,
// and that is said with the reason. The service itself knows nothing of this, and has no right to
// change it; it shows the page what stands in the file.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "apps/vcpu/process_vcpu.h"
#include "base/time.h"
#include "board/guarantee.h"
#include "board/linux/cpu_group.h"

namespace qduino::launcher {

inline constexpr Nanoseconds kServiceBudget = 10ms;
inline constexpr Nanoseconds kServicePeriod = 100ms;
inline constexpr int kServiceCore = 0;

class ServiceVcpu {
  public:
    /// `why_none` is said when there is no `budget`. `file` is where the page's copy is written.
    /// From a process with one thread.
    ServiceVcpu(std::optional<Nanoseconds> budget, const std::string& why_none, std::filesystem::path file);

    [[nodiscard]] const std::filesystem::path& file() const { return file_; }
    /// In the service's process, before it becomes the program.
    void enter() const;
    /// Admits it beside the loops that run by now.
    void admit_again();
    /// Writes the file anew now and then. `lives`: a service runs.
    void look(Instant now, bool lives);
    /// What holds, for the terminal.
    [[nodiscard]] std::string words() const;

  private:
    [[nodiscard]] board::TreeGuarantee guarantee() const;
    void write(Instant now);

    std::filesystem::path file_;
    std::optional<apps::ProcessVcpu> vcpu_;
    std::string why_none_;
    bool outside_ = false;  // a service runs, and is not in its group
    Instant started_{}, written_at_{};
    board::linux::CpuGroupUse use_;  // as of written_at_
};

}  // namespace qduino::launcher
