// Does admission need setup()? Loops declare themselves before main(), but calls in setup() declare
// I/O VCPUs.
#pragma once

namespace qduino::apps {

/// True when the calls that declare I/O VCPUs (attachInterrupt(), interruptsVcpu() …) are linked
/// into this program: its setup() may then make some. False: setup() cannot add to what admission
/// knows.
[[nodiscard]] bool setup_may_declare_vcpus();

}  // namespace qduino::apps
