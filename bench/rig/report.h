// The form in which every benchmark reports: the computer, the guarantees that held there, and a
// flat list of results.
//
//   {"machine":…, "kernel":…, "compiler":…, "commit":…, "guarantee":…, "results":[{…}, {…}]}
//
// If runs failed, there is also "failures":{"who: why": how many}.
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace qduino::bench {

using Json = nlohmann::ordered_json;

struct Report {
    /// The guarantees that held while it ran: text, or an object of the guarantee reports by
    /// variant.
    Json guarantee;
    std::vector<Json> results;            ///< flat objects, all with the same keys
    std::vector<std::string> remarks;     ///< for people: verdicts, what could not be had
    std::map<std::string, int> failures;  ///< "who: why", and how many runs ended like this

    void add_failure(const std::string& who, const std::string& why) { ++failures[who + ": " + why]; }
};

/// The results by their keys "load" and "who", as long as they stay as they are.
std::map<std::string, std::map<std::string, const Json*>> by_load_and_who(const Report& report);

/// A remark on a bound that the project sets itself: "holds" or "MISSED", and the figure, formatted
/// as by printf.
[[gnu::format(printf, 2, 3)]] std::string verdict(bool holds, const char* format, ...);

/// To standard output: one JSON object, or a table of 80 to 130 columns with the remarks below it.
void print(const Report& report, bool json);

/// CPU model and count of CPUs.
std::string computer_name();
std::string kernel_release();
/// The commit of the tree that this was built from; "unknown" outside a checkout.
std::string commit();

}  // namespace qduino::bench
