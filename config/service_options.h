// The print service's options that are for people: printd takes them, and so do printer-launcher
// and ./run, which hand them on.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "terminal/command_line.h"

namespace qduino::apps {

struct ServiceOptions {
    // The ways in (docs/reach.md).
    std::string name;                          ///< on the network: NAME and NAME.local; empty: none
    std::vector<std::string> hosts;            ///< further names that browsers may use
    std::vector<std::string> trusted_proxies;  ///< addresses whose X-Forwarded-… fields count
    std::string tls_certificate, tls_key;      ///< PEM files; empty: one of its own
    // The queue, and what is kept.
    std::uint64_t upload_max_mib = 2048;
    std::string after_failure = "hold";  ///< or "continue"
    bool confirm_bed = true;
    bool prologue = false;             ///< home and heat first what brings neither
    std::int64_t keep_jobs = 100'000;  ///< ended ones; 0: all
    std::int64_t keep_days = 0;        ///< 0: for ever
    std::uint64_t store_max_mib = 0;   ///< 0: as much as the disk has

    [[nodiscard]] bool operator==(const ServiceOptions&) const = default;
};

/// Declares them on a command line; `options` outlives the parsing.
void declare_service_options(CommandLine& line, ServiceOptions& options);

/// What is wrong with what was given together; empty: nothing.
[[nodiscard]] std::string problem_of(const ServiceOptions& options);

/// The words that give another program the same options.
[[nodiscard]] std::vector<std::string> words_of(const ServiceOptions& options);

}  // namespace qduino::apps
