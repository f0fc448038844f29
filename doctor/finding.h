// A finding of the doctor, and the tables of checks.
#pragma once

#include <span>
#include <string>
#include <utility>
#include <vector>

#include "doctor/facts.h"

namespace qduino::apps::doctor {

enum class State {
    ok,
    better,   ///< works, but could be better
    missing,  ///< something that a sketch needs is not there
};

struct Finding {
    State state = State::ok;
    std::string found;  ///< what there is
    /// When it is not ok, or could be had; a command begins with "sudo " or "echo ".
    std::string fix;
};

inline Finding ok(std::string found) { return {State::ok, std::move(found), ""}; }
inline Finding better(std::string found, std::string fix) {
    return {State::better, std::move(found), std::move(fix)};
}
inline Finding missing(std::string found, std::string fix) {
    return {State::missing, std::move(found), std::move(fix)};
}

struct Check {
    const char* id;
    const char* why;  ///< why it matters, in one clause
    Finding (*look)(const Facts& facts);
};

struct Group {
    const char* title;
    std::span<const Check> checks;
};

/// The report has the groups in this order.
std::span<const Check> kernel_checks();
std::span<const Check> core_checks();
std::span<const Check> interrupt_checks();
std::span<const Check> host_checks();
std::span<const Check> permission_checks();
std::vector<Group> all_checks();

/// Time that the host took from this computer's cores between two readings of /proc/stat, in
/// percent of all time; 0 when nothing passed.
double stolen_percent(std::string_view before, std::string_view after);

}  // namespace qduino::apps::doctor
