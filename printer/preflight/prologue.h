// "Home and heat first": lines in front of a job that brings neither, because the firmware that it
// was sliced for does both by itself (UltiGCode, Griffin, RepRapFirmware's start.g).
//
//   [start] of the machine file, or what its numbers give ──┐
//   {HOT_END} {BED}: the slicer's, from its comments ───────┴─► lines ─► in front of the file
//
// The lines become a part of the job: preflight, printer and twin read them as its first ones.
#pragma once

#include <string>

#include "printer/machine_config.h"
#include "printer/preflight/facts.h"

namespace qduino::printer::preflight {

/// For a job with these facts, which preflight has refused for nothing else
/// (Facts::lacks_start()). Ends with a line feed.
[[nodiscard]] std::string prologue_of(const MachineConfig& machine, const Facts& facts);

}  // namespace qduino::printer::preflight
