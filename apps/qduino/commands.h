// What each command of `qduino` does.
#pragma once

#include "apps/qduino/arguments.h"

namespace qduino::apps {

/// Does what `arguments.command` says. Returns the exit status: 0, 1 on failure, 2 when admission refuses the
/// sketch. `parser` is for `completion`.
int run_command(const Arguments& arguments, const CLI::App& parser);

}  // namespace qduino::apps
