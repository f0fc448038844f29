#include "qduino/vcpu_command.h"

#include <filesystem>

#include "posix/small_file.h"
#include "report/guarantee_report.h"
#include "terminal/message.h"
#include "vcpu/tree_run.h"
#include "vcpu/vcpu_report.h"

namespace qduino::apps {
namespace {

constexpr std::string_view kPrefix = "qduino: ";
constexpr int kRefused = 2;

std::string vcpu_words(const board::linux::TreeVcpu& tree) {
    return text<std::string>("VCPU of ", tree.budget, " in ", tree.period, " on core ", tree.core);
}

void say_admitted(const ProcessVcpu& vcpu) {
    const board::linux::TreeVerdict& verdict = vcpu.verdict();
    say(text<std::string>(vcpu_words(vcpu.tree()), " is admitted: R = ", verdict.response,
                          " <= ", vcpu.tree().period, verdict.above.empty() ? "" : ", below ", verdict.above,
                          "; kept by ", vcpu.enforced_by()),
        kPrefix);
}

Result<void> write_report(const Arguments& arguments, const ProcessVcpu& vcpu,
                          const board::linux::CpuGroupUse& use, Nanoseconds lasted) {
    if (arguments.report.empty()) return {};
    return posix::write_file(
        arguments.report,
        vcpu_json(guarantee_of(vcpu), vcpu.enforced_by(), use, lasted, share_of(use.used, lasted)) + '\n');
}

}  // namespace

Result<int> run_in_vcpu(const Arguments& arguments) {
    const std::string program = std::filesystem::path{arguments.program.at(0)}.filename();
    QDUINO_TRY_ASSIGN(const ProcessVcpu vcpu,
                      ProcessVcpu::make({.tree = {.name = program,
                                                  .core = arguments.core.value_or(sched::kAnyCore),
                                                  .budget = arguments.budget,
                                                  .period = arguments.period}}));
    if (!vcpu.active()) {
        say(vcpu.verdict().refusal, kPrefix);
        say(verdict(program + " is REFUSED: it did not run."));
        return kRefused;
    }
    if (!arguments.quiet) say_admitted(vcpu);
    QDUINO_TRY(write_report(arguments, vcpu, {}, Nanoseconds{0}));
    QDUINO_TRY_ASSIGN(
        const TreeEnd end, run_tree(vcpu, arguments.program, [&] {
            if (!arguments.quiet)
                say(program + " has ended; what it left running stays in the VCPU (Ctrl-C ends it)", kPrefix);
        }));
    QDUINO_TRY_ASSIGN(const board::linux::CpuGroupUse use, vcpu.group().use());
    QDUINO_TRY(write_report(arguments, vcpu, use, end.lasted));
    if (!arguments.quiet)
        say(text<std::string>(vcpu_words(vcpu.tree()), ": ", use_text(vcpu.tree(), use, end.lasted)),
            kPrefix);
    return end.status;
}

}  // namespace qduino::apps
