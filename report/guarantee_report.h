// The guarantee report for people (text, 80 columns) and for programs (JSON).
#pragma once

#include <string>

#include "base/result.h"
#include "board/guarantee.h"

namespace qduino::apps {

/// For each loop, what is enforced and what is not, with the reason and the fix on the next line.
std::string guarantee_text(const board::GuaranteeReport& report);

/// What holds of a loop, for a sentence: "yes", or what does not: "NO (…)".
std::string in_a_word(const board::LoopGuarantee& loop);

/// At the end of a run: whether each loop kept to its budget, as the watch outside of it has
/// measured. Names each that did not, what it did and what it had. Lines of text; none where no
/// budget was watched.
std::string budgets_kept(const board::GuaranteeReport& report);

/// At the end of a run: how long after its edge each handler came, and whether it was done within
/// what admission promises. A line of text for each I/O VCPU that ran handlers.
std::string handlers_kept(const board::GuaranteeReport& report);

/// At the end of a run: where more interrupts came than admission counts; and of each loop that was
/// late by how much at the worst, and what took its core then. Lines of text.
std::string delays_explained(const board::GuaranteeReport& report);

/// {"board":…,"simulated":…,"memory_locked":…,"watch_cost_us","strange_threads","ran_us",
/// "watch_lost","intruders","loops":[{"id","core","budget_us","period_us","priority_enforced",
/// "budget_enforced","core_owned","shortfall","cpu_used_us","watched_us","held_from_outside",
/// "escape","taken","kernel_threads","kernel_cpu_us","kernel_held","releases","overruns","dropped",
/// "missed","worst_late_us"}…],"cores":[{"core","interrupts_per_second","worst_gap_us",
/// "counted_per_second","counted_us","counted_share","counted_at_once_us","tick_stopped",
/// "throttling_lifted","note"}…],"bottom_halves":[{"id","core","timed","untimed","begin_p50_us",
/// "begin_p999_us","begin_worst_us","end_worst_us","response_us","replenishment_us"}…],
/// "delays":[{"id","core","worst_us","at_s","window_s","host_us","tasks_us","interrupted_us",
/// "interrupts","most","throttled","beyond_us","stopped_us","quota_us","cause","late_tasks",
/// "late_host","late_interrupts","late_charged","late_work","late_unseen","late_untold",
/// "late_stopped","late_quota"}…],"trees":[tree_json()…],"chains":[{"name","way",
/// "reaction_bound_us","reaction_limit_us","age_bound_us","age_limit_us","reactions",
/// "worst_reaction_us","worst_age_us","from_first_loop"}…]}; `counted…`: interrupts that admission
/// counts; `late_…`: releases that ended late, by cause. A value that was not measured, or is none,
/// is null.
std::string guarantee_json(const board::GuaranteeReport& report);

/// {"name","core","budget_us","period_us","admitted","response_us","enforced","shortfall"};
/// "response_us" is null when it is not admitted.
std::string tree_json(const board::TreeGuarantee& tree);

/// Writes the JSON to `path`, whole or not at all: a reader meanwhile gets the old file. Error: it
/// cannot be written there.
Result<void> write_guarantee(const board::GuaranteeReport& report, const std::string& path);

}  // namespace qduino::apps
