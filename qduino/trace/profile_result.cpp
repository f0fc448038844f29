#include "qduino/trace/profile_result.h"

#include <cstdio>
#include <nlohmann/json.hpp>

#include "terminal/human.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps {

Result<std::vector<BudgetEdit>> suggested_edits(const std::string& profile) {
    using Json = nlohmann::json;
    const auto duration = [](const Json& json, const char* key) {
        return Nanoseconds{json.at(key).get<std::int64_t>()};
    };
    std::vector<BudgetEdit> edits;
    try {
        const Json read = Json::parse(profile);
        const auto add = [&](const Json& measured, BudgetEdit edit) {
            const Json& declared = measured.at("declared");
            const Json& suggested = measured.at("suggested");
            if (suggested.is_null()) return;
            edit.budget_was = duration(declared, "budget_ns");
            edit.period_was = duration(declared, "period_ns");
            edit.budget = duration(suggested, "budget_ns");
            edit.period = duration(suggested, "period_ns");
            edits.push_back(edit);
        };
        for (const Json& loop : read.at("loops")) {
            add(loop, {.id = loop.at("id").get<int>(),
                       .file = loop.at("file").get<std::string>(),
                       .line = loop.at("line").get<int>()});
        }
        for (const Json& handler : read.at("handlers"))
            add(handler, {.id = handler.at("pin").get<int>(), .handler = true});
    } catch (const Json::exception& wrong) {
        return make_error(ErrorCode::corrupt, "the sketch's program wrote no profile: ", wrong.what());
    }
    return edits;
}

Result<int> apply_profile(const std::string& profile, const std::vector<TabText>& tabs, bool write) {
    QDUINO_TRY_ASSIGN(const std::vector<BudgetEdit> edits, suggested_edits(profile));
    const EditedSketch edited = edit_budgets(tabs, edits);
    std::fputs(edited.diff.c_str(), stdout);
    std::fflush(stdout);
    for (const std::string& refusal : edited.refusals) say(refusal, "qduino: ");
    if (edited.diff.empty() && edited.refusals.empty()) {
        say(verdict("nothing is to be changed."));
        return 0;
    }
    if (!write) {
        say(verdict("nothing is written; --write puts this into the sketch."));
        return 0;
    }
    if (!edited.refusals.empty()) {
        const auto count = static_cast<long long>(edited.refusals.size());
        say(verdict("NOTHING is written: " + counted(count, "declaration") + " cannot be changed."));
        return 1;
    }
    QDUINO_TRY(write_tabs(tabs, edited.tabs));
    say(verdict("the sketch has these budgets now; see `qduino check`."));
    return 0;
}

}  // namespace qduino::apps
