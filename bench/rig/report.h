// The form in which every benchmark reports: where it ran, what held there, and a flat list of results.
//
//   {"machine":…, "kernel":…, "compiler":…, "commit":…, "guarantee":…, "results":[{…}, {…}]}
//
// and, where runs failed, "failures":{"who: why": how many}.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace qduino::bench {

using Json = nlohmann::ordered_json;

struct Report {
    Json guarantee;  ///< what held while it ran: text, or an object of the guarantee reports by variant
    std::vector<Json> results;            ///< flat objects, all with the same keys
    std::vector<std::string> remarks;     ///< for people: verdicts, what could not be had
    std::map<std::string, int> failures;  ///< "who: why", and how many runs ended so

    void add_failure(const std::string& who, const std::string& why) { ++failures[who + ": " + why]; }
};

/// A remark on what the project holds itself to: "holds" or "MISSED", and the figure, as printf has it.
[[gnu::format(printf, 2, 3)]] std::string verdict(bool holds, const char* format, ...);

/// To standard output: one JSON object, or a table of 80 to 130 columns with the remarks below it.
void print(const Report& report, bool json);

/// CPU model and count of CPUs.
std::string machine_name();
std::string kernel_release();
/// Of the tree that this was built from; "unknown" outside a checkout.
std::string commit();

}  // namespace qduino::bench
