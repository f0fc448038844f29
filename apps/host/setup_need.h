// Does admission need setup()? Loops declare themselves before main(); I/O VCPUs are declared by calls in
// setup().
#pragma once

namespace qduino::apps {

/// True when this program has the calls that declare I/O VCPUs (attachInterrupt(), interruptsVcpu() …) linked
/// into it: then its setup() may make some. False: setup() can add nothing to what admission knows already.
[[nodiscard]] bool setup_may_declare_vcpus();

}  // namespace qduino::apps
