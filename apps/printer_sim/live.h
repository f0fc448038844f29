// printer-sim as a live machine: linked to a running print service, paced at K times wall time.
#pragma once

#include <string>

#include "base/result.h"
#include "printer/machine_config.h"

namespace qduino::apps {

struct LiveOptions {
    printer::MachineConfig machine;
    std::string link_path;     ///< made anew; the service opens it
    std::string inspect_path;  ///< unix socket of the twin's inspector; empty: none
    double speed = 1;          ///< virtual seconds per second of wall time; > 0
};

/// Runs until SIGTERM or SIGINT. When the host cannot keep up, virtual time falls behind: nothing
/// is skipped.
Result<void> run_live(const LiveOptions& options);

}  // namespace qduino::apps
