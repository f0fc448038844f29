// What interrupts take of a core, remembered from start to start until the computer boots again:
//
//   /run/qduino/qduino-interrupts.0     root's, for core 0; shared_file.h says where others' lie
//     counts 25000 240000 63000 180000          share, burst, peak, its burst: millionths, ns
//     look 1061000 97500 5 12 96000 95800 …     taken, worst; ticks, others; the burst of each rate
//     run 980000 5 17                           taken; ticks, others
//     …                                         the oldest first: a hundred looks, forty of runs
//
// Each start adds looks, each run what it saw, and the oldest of their kind go: runs, which know
// less, do not push looks out. Not real-time.
//
// Somebody who knows the computer's figures, or wants the same verdict at every start whatever
// others do, says them in the environment, in the units of `counts`; then nobody looks:
//
//   QDUINO_INTERRUPTS="25000 240000 63000 180000"
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "board/linux/computer/interference.h"

namespace qduino::board::linux {

class InterferenceMemory {
  public:
    static constexpr std::size_t kLooks = 100, kRuns = 40;

    /// What this user, or root, has remembered of `core`. Empty when there is no such file, or
    /// none that is believed (posix/guarded_file.h). `root` precedes the folders (tests).
    [[nodiscard]] static InterferenceMemory read(int core, const std::string& root = "");
    /// From the text of a file; lines that are malformed or out of range are left out.
    [[nodiscard]] static InterferenceMemory parse(std::string_view text);

    /// Looks.
    [[nodiscard]] std::size_t size() const { return looks_.size(); }
    /// From the text of QDUINO_INTERRUPTS. Nothing when it is malformed or out of range.
    [[nodiscard]] static std::optional<InterferenceFigures> figures_said(std::string_view text);
    void add(const std::vector<InterferenceLook>& looks);
    /// The same of what a run saw, `count` times: it lasted as long as so many looks.
    void add_run(const InterferenceLook& look, std::size_t count);
    /// What is known now; what is counted of it is remembered.
    [[nodiscard]] Interference interference();

    [[nodiscard]] std::string text() const;
    /// Puts it in the place of this user's file. Errors: no folder is this user's alone, and what
    /// the kernel says.
    [[nodiscard]] Result<void> write(int core, const std::string& root = "") const;

  private:
    InterferenceFigures counted_;
    std::vector<InterferenceLook> looks_, runs_;
};

}  // namespace qduino::board::linux
