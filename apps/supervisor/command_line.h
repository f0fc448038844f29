// The program qduino-supervisor without its main(): tests run it on a system of their own.
#pragma once

#include "apps/supervisor/system_calls.h"

namespace qduino::supervisor {

/// Returns the exit status.
int run_command_line(int argc, char** argv, SystemCalls& system);

}  // namespace qduino::supervisor
