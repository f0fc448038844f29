// What interrupts take of a core, remembered from start to start until the computer boots again:
//
//   /run/qduino/qduino-interrupts.0     root's, for core 0; shared_file.h says where others' lie
//     counted 82000 61000 240000 91000          share in millionths; usual, burst, longest in ns
//     look 1061000 75000 97500 97500 5 12       taken, usual, longest, worst in ns; ticks, others
//     …                                         the oldest first, a hundred of them
//
// Each start and each run adds looks, and the oldest go. Not real-time.
//
// Somebody who knows the computer's figures, or wants the same verdict at every start whatever
// others do, says them in the environment, in the units of `counted`; then nobody looks:
//
//   QDUINO_INTERRUPTS="15000 75000 100000 90000"
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
    static constexpr std::size_t kLooks = 100;

    /// What this user, or root, has remembered of `core`. Empty when there is no such file, or
    /// none that is believed (posix/guarded_file.h). `root` precedes the folders (tests).
    [[nodiscard]] static InterferenceMemory read(int core, const std::string& root = "");
    /// From the text of a file; lines that are malformed or out of range are left out.
    [[nodiscard]] static InterferenceMemory parse(std::string_view text);

    [[nodiscard]] std::size_t size() const { return looks_.size(); }
    /// From the text of QDUINO_INTERRUPTS. Nothing when it is malformed or out of range.
    [[nodiscard]] static std::optional<InterferenceFigures> figures_said(std::string_view text);
    void add(const std::vector<InterferenceLook>& looks);
    /// What is known now; what is counted of it is remembered.
    [[nodiscard]] Interference interference();

    [[nodiscard]] std::string text() const;
    /// Puts it in the place of this user's file. Errors: no folder is this user's alone, and what
    /// the kernel says.
    [[nodiscard]] Result<void> write(int core, const std::string& root = "") const;

  private:
    InterferenceFigures counted_;
    std::vector<InterferenceLook> looks_;
};

}  // namespace qduino::board::linux
