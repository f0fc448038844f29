// printd's command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/service_options.h"

namespace qduino::printd {

struct Options : apps::ServiceOptions {
    std::filesystem::path state;
    std::filesystem::path link;
    std::string address = "127.0.0.1";
    std::uint16_t port = 8080;
    std::filesystem::path ui;       ///< empty: no page
    std::string inspect;            ///< socket of the virtual machine's inspector; empty: none
    std::string serial_port;        ///< socket for printer-port; empty: no serial host
    bool serial_wire = false;       ///< its port cannot tell whether a host is there
    std::filesystem::path vcpu;     ///< file that says what keeps this service; empty: none
    std::filesystem::path machine;  ///< empty: the reference machine
    std::string run_as;             ///< empty: as who we are
    bool recover = false;           ///< do not serve: make jobs of the stored files
    bool authentication = true;
    bool print_link = false;
    bool verbose = false;
};

/// Nothing when help was asked for, or the line was wrong and the user was told: leave with
/// `exit_status`.
[[nodiscard]] std::optional<Options> parse_options(int argc, char** argv, int& exit_status);

}  // namespace qduino::printd
