#include "doctor/doctor.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "base/words.h"
#include "doctor/finding.h"
#include "terminal/human.h"
#include "terminal/message.h"

namespace qduino::apps {
namespace {

using doctor::Check;
using doctor::Facts;
using doctor::Finding;
using doctor::Group;
using doctor::State;
using Json = nlohmann::ordered_json;

constexpr Words<State::ok, State::missing> kStates{"ok", "could be better", "missing"};

struct Entry {
    const char* group;
    const Check* check;
    Finding finding;
};

std::vector<Entry> audit(const Facts& facts) {
    std::vector<Entry> entries;
    for (const Group& group : doctor::all_checks()) {
        for (const Check& check : group.checks) entries.push_back({group.title, &check, check.look(facts)});
    }
    return entries;
}

long count(const std::vector<Entry>& entries, State state) {
    return std::count_if(entries.begin(), entries.end(),
                         [&](const Entry& entry) { return entry.finding.state == state; });
}

std::string summary(const std::vector<Entry>& entries) {
    const long better = count(entries, State::better);
    const long missing = count(entries, State::missing);
    const std::string all = std::to_string(entries.size());
    if (better + missing == 0) return "all " + all + " are as they should be.";
    std::string words;
    if (better > 0) write(words, better, " of ", all, " could be better", missing > 0 ? ", " : "");
    if (missing > 0)
        write(words, missing, better > 0 ? "" : " of " + all, missing == 1 ? " is missing" : " are missing");
    return words + ".";
}

/// Pins are no matter of time: a sketch with virtual ones can do without.
bool is_of_pins(const Entry& entry) {
    constexpr std::array<std::string_view, 3> kPins{"gpio", "i2c", "spi"};
    return std::ranges::find(kPins, entry.check->id) != kPins.end();
}

/// What a beginner wants to know, before all else: may I begin, and what must I do? One fix may
/// mend several findings.
std::string first_words(const std::vector<Entry>& entries) {
    std::vector<std::string> fixes;
    bool time = false, pins = false;
    for (const Entry& entry : entries) {
        if (entry.finding.state != State::missing) continue;
        (is_of_pins(entry) ? pins : time) = true;
        if (std::ranges::find(fixes, entry.finding.fix) == fixes.end()) fixes.push_back(entry.finding.fix);
    }
    if (fixes.empty()) {
        const long better = count(entries, State::better);
        if (better == 0) return "You can run sketches, in real time as well.\n";
        return wrapped("You can run sketches, in real time as well. What could be better is told below (" +
                           std::to_string(better) + "); nothing of it has to be done first.",
                       "");
    }
    const char* const wanted = time && pins ? "real time and real pins" : time ? "real time" : "real pins";
    std::string out = text<std::string>(
        "You can run sketches. For ", wanted, " do ",
        fixes.size() == 1 ? std::string{"this"} : "these " + std::to_string(fixes.size()), ":\n");
    for (std::size_t i = 0; i < fixes.size(); ++i)
        out += wrapped_command(fixes[i], text<std::string>("  ", i + 1, "  "));
    return out;
}

std::string computer_of(const Facts& facts) {
    return facts.model() + ", " + counted(facts.core_count(), "core");
}

std::string report_text(const Facts& facts, const std::vector<Entry>& entries) {
    std::string out = first_words(entries) + "\n" + wrapped(computer_of(facts), "Computer: ") +
                      wrapped(facts.release() + " " + facts.architecture(), "Kernel:   ");
    const char* group = "";
    for (const Entry& entry : entries) {
        if (entry.group != group) write(out, '\n', entry.group, '\n');
        group = entry.group;
        out += wrapped(entry.finding.found, text("  ", column(kStates(entry.finding.state), -15), "  ",
                                                 column(entry.check->id, -17), ' '));
        if (entry.finding.state == State::ok) {
            if (!entry.finding.fix.empty()) out += wrapped_command(entry.finding.fix, "      how  ");
            continue;
        }
        out += wrapped(entry.check->why, "      why  ");
        out += wrapped_command(entry.finding.fix, "      fix  ");
    }
    return out + "\n" + verdict(summary(entries), false);
}

std::string report_json(const Facts& facts, const std::vector<Entry>& entries) {
    Json findings = Json::array();
    for (const Entry& entry : entries) {
        findings.push_back({{"id", entry.check->id},
                            {"state", kStates(entry.finding.state)},
                            {"found", entry.finding.found},
                            {"why", entry.check->why},
                            {"fix", entry.finding.fix}});
    }
    const Json out{{"machine", computer_of(facts)}, {"kernel", facts.release()}, {"findings", findings}};
    // Names come from firmware: bytes that are no text are replaced and not refused.
    return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace

std::vector<doctor::Group> doctor::all_checks() {
    return {{"Kernel", kernel_checks()},
            {"Cores", core_checks()},
            {"Interrupts", interrupt_checks()},
            {"Computer", host_checks()},
            {"Permissions", permission_checks()}};
}

int run_doctor(const DoctorOptions& options, std::FILE* out) {
    const Facts facts{options.root};
    const std::vector<Entry> entries = audit(facts);
    std::fputs((options.json ? report_json(facts, entries) : report_text(facts, entries)).c_str(), out);
    return count(entries, State::ok) == static_cast<long>(entries.size()) ? 0 : 1;
}

}  // namespace qduino::apps
