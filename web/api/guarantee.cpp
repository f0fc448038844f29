#include "web/api/guarantee.h"

#include <algorithm>
#include <array>
#include <span>

namespace qduino::web::api {
namespace {

enum class Kind : std::uint8_t {
    count,     ///< a whole number from 0 on
    number,    ///< from 0 on
    measured,  ///< likewise, or null: nobody has measured it
    flag,
    text,
};

struct Member {
    const char* name;
    Kind kind;
};

/// What the page reads of each row. Others may be there as well.
constexpr std::array kLoopMembers{Member{"id", Kind::count},
                                  Member{"core", Kind::count},
                                  Member{"budget_us", Kind::number},
                                  Member{"period_us", Kind::number},
                                  Member{"priority_enforced", Kind::flag},
                                  Member{"budget_enforced", Kind::flag},
                                  Member{"core_owned", Kind::flag},
                                  Member{"shortfall", Kind::text},
                                  Member{"cpu_used_us", Kind::measured},
                                  Member{"watched_us", Kind::measured},
                                  Member{"held_from_outside", Kind::count},
                                  Member{"escape", Kind::text},
                                  Member{"releases", Kind::measured},
                                  Member{"overruns", Kind::measured},
                                  Member{"missed", Kind::measured},
                                  Member{"worst_late_us", Kind::measured}};
constexpr std::array kCoreMembers{Member{"core", Kind::count},
                                  Member{"interrupts_per_second", Kind::measured},
                                  Member{"worst_gap_us", Kind::measured},
                                  Member{"counted_per_second", Kind::measured}, Member{"note", Kind::text}};
constexpr std::array kTreeMembers{Member{"name", Kind::text},        Member{"core", Kind::count},
                                  Member{"budget_us", Kind::number}, Member{"period_us", Kind::number},
                                  Member{"admitted", Kind::flag},    Member{"enforced", Kind::flag},
                                  Member{"shortfall", Kind::text}};

constexpr std::array kChainMembers{Member{"name", Kind::text},
                                   Member{"way", Kind::text},
                                   Member{"reaction_bound_us", Kind::number},
                                   Member{"reaction_limit_us", Kind::measured},
                                   Member{"age_bound_us", Kind::measured},
                                   Member{"age_limit_us", Kind::measured},
                                   Member{"reactions", Kind::count},
                                   Member{"worst_reaction_us", Kind::measured},
                                   Member{"worst_age_us", Kind::measured},
                                   Member{"from_first_loop", Kind::flag}};

struct Table {
    const char* name;
    std::span<const Member> members;
};

constexpr std::array kTables{Table{"loops", kLoopMembers}, Table{"cores", kCoreMembers},
                             Table{"bottom_halves", {}},   Table{"delays", {}},
                             Table{"trees", kTreeMembers}, Table{"chains", kChainMembers}};

bool is_a(const Json& value, Kind kind) {
    switch (kind) {
        case Kind::count:
            return value.is_number_unsigned();
        case Kind::number:
            return value.is_number() && value.get<double>() >= 0;
        case Kind::measured:
            return value.is_null() || is_a(value, Kind::number);
        case Kind::flag:
            return value.is_boolean();
        case Kind::text:
            return value.is_string();
    }
    return false;
}

bool has(const Json& object, const Member& member) {
    const auto at = object.find(member.name);
    return at != object.end() && is_a(*at, member.kind);
}

bool is_row(const Json& row, std::span<const Member> members) {
    return row.is_object() &&
           std::none_of(row.begin(), row.end(), [](const Json& value) { return value.is_structured(); }) &&
           std::ranges::all_of(members, [&](const Member& member) { return has(row, member); });
}

bool has(const Json& report, const Table& table) {
    const auto at = report.find(table.name);
    return at != report.end() && at->is_array() && at->size() <= kGuaranteeRows &&
           std::all_of(at->begin(), at->end(), [&](const Json& row) { return is_row(row, table.members); });
}

}  // namespace

std::optional<Json> checked_guarantee(std::string_view text) {
    Json report = Json::parse(text, nullptr, false);
    if (!report.is_object() || !has(report, Member{"board", Kind::text})) return std::nullopt;
    if (!std::ranges::all_of(kTables, [&](const Table& table) { return has(report, table); }))
        return std::nullopt;
    const auto tables =
        std::count_if(report.begin(), report.end(), [](const Json& value) { return value.is_structured(); });
    if (tables != static_cast<std::ptrdiff_t>(kTables.size())) return std::nullopt;
    return report;
}

}  // namespace qduino::web::api
