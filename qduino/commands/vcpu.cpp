// qduino vcpu: any command in an admitted, enforced VCPU.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/toml_section.h"
#include "posix/small_file.h"
#include "qduino/command.h"
#include "report/guarantee_report.h"
#include "terminal/message.h"
#include "terminal/parser.h"
#include "vcpu/tree_run.h"
#include "vcpu/vcpu_report.h"

namespace qduino::apps {
namespace {

constexpr std::string_view kPrefix = "qduino: ";
constexpr int kRefused = 2;

std::string vcpu_words(const board::linux::TreeVcpu& tree) {
    return text<std::string>("VCPU of ", tree.budget, " in ", tree.period, " on core ", tree.core);
}

/// A duration in milliseconds, or with its unit: "10", "0.5", "500us", "1s".
void add_duration(CLI::App& app, const char* name, Nanoseconds& value, const char* description) {
    const auto take = [name, &value](const std::string& words) {
        const bool bare = words.find_first_not_of("0123456789.") == std::string::npos;
        const std::optional<Nanoseconds> read = parse_duration(bare ? words + "ms" : words);
        if (!read || *read <= Nanoseconds{0})
            throw CLI::ValidationError(name,
                                       "'" + words + "' is no duration above 0: write 10, 10ms, 500us or 1s");
        value = *read;
    };
    app.add_option_function<std::string>(name, take, description)->option_text("MS");
}

/// How many of the words are the options of `qduino vcpu`; then comes "--", or the command.
std::size_t count_options(const CLI::App& app, const std::vector<std::string>& words) {
    std::size_t at = 0;
    while (at < words.size()) {
        if (words[at] == "--" || !words[at].starts_with('-')) break;
        const CLI::Option* option = app.get_option_no_throw(words[at]);
        at += option && option->get_items_expected_max() > 0 ? 2 : 1;
    }
    return std::min(at, words.size());
}

class Vcpu final : public Command {
    void declare(CLI::App& app) override {
        add_duration(app, "--budget", budget_, "CPU time in each period (default 10 ms)");
        add_duration(app, "--period", period_, "The period, up to 1 s (default 100 ms)");
        add_option(app, "--core", core_, "The core (default: the first that admits it)", "N")
            ->check(whole_number_within(0, 1023));
        add_option(app, "--report", report_, "Write guarantee and use here, as JSON", "FILE");
        app.add_flag("-q,--quiet", quiet_, "Say nothing but errors");
        app.callback([this] {
            if (program_.empty()) throw CLI::RequiredError("COMMAND, what is to run in the VCPU,");
        });
    }

    std::size_t take_words(const CLI::App& app, const std::vector<std::string>& words) override {
        const std::size_t own = count_options(app, words);
        const bool marked = own < words.size() && words[own] == "--";
        program_.assign(words.begin() + static_cast<std::ptrdiff_t>(own + (marked ? 1 : 0)), words.end());
        return own;
    }

    Result<int> run() override {
        const std::string program = std::filesystem::path{program_.at(0)}.filename();
        QDUINO_TRY_ASSIGN(const ProcessVcpu vcpu,
                          ProcessVcpu::make({.tree = {.name = program,
                                                      .core = core_.value_or(sched::kAnyCore),
                                                      .budget = budget_,
                                                      .period = period_}}));
        if (!vcpu.active()) {
            say(vcpu.verdict().refusal, kPrefix);
            say(verdict(program + " is REFUSED: it did not run."));
            return kRefused;
        }
        if (!quiet_) say_admitted(vcpu);
        QDUINO_TRY(write_report(vcpu, {}, Nanoseconds{0}));
        QDUINO_TRY_ASSIGN(
            const TreeEnd end, run_tree(vcpu, program_, [&] {
                if (!quiet_)
                    say(program + " has ended; what it left running stays in the VCPU (Ctrl-C ends it)",
                        kPrefix);
            }));
        QDUINO_TRY_ASSIGN(const board::linux::CpuGroupUse use, vcpu.group().use());
        QDUINO_TRY(write_report(vcpu, use, end.lasted));
        if (!quiet_)
            say(text<std::string>(vcpu_words(vcpu.tree()), ": ", use_text(vcpu.tree(), use, end.lasted)),
                kPrefix);
        return end.status;
    }

    static void say_admitted(const ProcessVcpu& vcpu) {
        const board::linux::TreeVerdict& verdict = vcpu.verdict();
        say(text<std::string>(vcpu_words(vcpu.tree()), " is admitted: R = ", verdict.response,
                              " <= ", vcpu.tree().period, verdict.above.empty() ? "" : ", below ",
                              verdict.above, "; kept by ", vcpu.enforced_by()),
            kPrefix);
    }

    [[nodiscard]] Result<void> write_report(const ProcessVcpu& vcpu, const board::linux::CpuGroupUse& use,
                                            Nanoseconds lasted) const {
        if (report_.empty()) return {};
        return posix::write_file(report_, vcpu_json(guarantee_of(vcpu), vcpu.enforced_by(), use, lasted,
                                                    share_of(use.used, lasted)) +
                                              '\n');
    }

    // The paper's default VCPU (RTAS 2017, section IV), unless others are named.
    Nanoseconds budget_ = 10ms, period_ = 100ms;
    std::optional<int> core_;
    std::string report_;
    bool quiet_ = false;
    std::vector<std::string> program_;
};

const Listed<Vcpu> vcpu_listed{
    {Place::vcpu, "vcpu", "Run any command in a VCPU",
     "COMMAND and all that it starts get the budget in each period, if the loops on\n"
     "that core leave it, and never more: the kernel's control groups keep it. Plain\n"
     "numbers are milliseconds; 500us and 1s work as well. Ends as COMMAND does,\n"
     "when its last process has ended; with 2 when admission refuses it.\n"
     "Example: qduino vcpu --budget 10 --period 100 --core 0 -- make -j4"}};

}  // namespace
}  // namespace qduino::apps
