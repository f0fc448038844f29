// The guarantee report on its way to the service: as of now, for as long as the sketch runs.
#pragma once

#include "printer/link/layout.h"
#include "runtime/runtime.h"

namespace qduino::apps {

/// How old the report is at most that the service reads, on the wall clock.
inline constexpr Nanoseconds kGuaranteeEvery = 1s;

/// Writes what the board of `runtime` guarantees now, and how its loops have kept their periods. A
/// report that is too long for the link (GuaranteeText) is not written: half a report is none. On
/// the host's thread alone: the link's slot has one writer. Allocates, and reads files of /proc.
void publish_guarantee(printer::link::LinkLayout& link, runtime::Runtime& runtime);

/// Runs the loops until they have stopped, and publishes meanwhile. On the host's thread.
void run_and_publish(printer::link::LinkLayout& link, runtime::Runtime& runtime);

}  // namespace qduino::apps
