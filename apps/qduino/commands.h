// The commands of `qduino`.
#pragma once

#include "apps/qduino/arguments.h"

namespace qduino::apps {

/// Carries out `arguments.command`. Returns the exit status: 0, 1 on failure, 2 when admission
/// refuses the sketch. `parser` is for `completion`.
int run_command(const Arguments& arguments, const CLI::App& parser);

}  // namespace qduino::apps
