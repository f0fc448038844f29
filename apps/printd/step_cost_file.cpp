#include "apps/printd/step_cost_file.h"

#include <charconv>

#include "base/text.h"
#include "posix/durable_file.h"
#include "posix/small_file.h"

namespace qduino::printd {
namespace {

/// The other side, or the file, may hold anything.
bool is_step_cost(std::int64_t ns) { return ns > 0 && ns <= 1'000'000; }

}  // namespace

StepCostFile::StepCostFile(const std::filesystem::path& state, analysis::PreflightAnalyzer& analyzer)
    : path_(state / "step-cost-ns"), analyzer_(analyzer) {
    const Result<std::string> text = posix::read_small_file(path_);
    std::int64_t ns = 0;
    if (text) std::from_chars(text->data(), text->data() + text->size(), ns);
    if (is_step_cost(ns)) analyzer_.set_step_cost(Nanoseconds{ns});
}

bool StepCostFile::take(const printer::link::LinkLayout* link) {
    const std::int64_t ns = link ? link->step_cost_ns.load(std::memory_order_relaxed) : 0;
    if (!is_step_cost(ns) || Nanoseconds{ns} == analyzer_.step_cost()) return false;
    analyzer_.set_step_cost(Nanoseconds{ns});
    // Without it the next start knows no cost until the printer runs: no harm.
    static_cast<void>(posix::write_durably(path_, text<std::string>(ns, '\n')));
    return true;
}

}  // namespace qduino::printd
