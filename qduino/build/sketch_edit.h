// Changes the budgets and periods in the text of a sketch: `qduino profile --write`.
//
//   void loop(1, 2, 10, 0) {          TIME_UNIT(us);
//   void loop(1, 0.17, 10, 0) {       void loop(1, 170, 10ms) {
//
// Only the numbers change, in the unit that the sketch uses; every other byte stays. A loop's
// declaration is found by the file and line that the program was built from, and by its id; an
// attachInterruptVcpu() by its pin, a number that stands in one such call alone. It is changed only
// if its text says what the program had: both numbers plain, or with a unit of std::chrono. A name,
// a sum or a macro is refused, and then nothing is changed at all.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "base/time.h"

namespace qduino::apps {

/// A tab of a sketch as it was read.
struct TabText {
    std::filesystem::path path;
    std::string text;
};

/// The tabs, in the order in which they are joined. Error: one cannot be read.
[[nodiscard]] Result<std::vector<TabText>> read_tabs(const std::vector<std::filesystem::path>& paths);

/// A loop as the program had it, and as it is to be; or the VCPU of a pin's handler.
struct BudgetEdit {
    int id = 0;             ///< the loop's, or the pin
    std::string file = {};  ///< where a loop is declared
    int line = 0;
    Nanoseconds budget_was{}, period_was{};
    Nanoseconds budget{}, period{};
    bool handler = false;
};

struct EditedSketch {
    std::vector<TabText> tabs;          ///< all of them; unchanged when there are refusals
    std::vector<std::string> refusals;  ///< why one cannot be changed, each a sentence
    std::string diff;                   ///< unified, without context; empty: nothing changes
};
[[nodiscard]] EditedSketch edit_budgets(const std::vector<TabText>& tabs,
                                        const std::vector<BudgetEdit>& edits);

/// Writes the tabs that differ, each whole or not at all, with the permissions that it had. Error:
/// a tab is no longer as it was `before`, and then none is written; or one cannot be written.
[[nodiscard]] Result<void> write_tabs(const std::vector<TabText>& before, const std::vector<TabText>& after);

/// `value` as a literal in place of `literal`: a plain number of `unit`, or one with a unit of
/// std::chrono. For tests.
[[nodiscard]] std::string literal_for(Nanoseconds value, const std::string& literal, Nanoseconds unit);

}  // namespace qduino::apps
