// The certificate of an admission: all that it assumed of each core, and the response times that it
// derived from that, as JSON in whole nanoseconds. tools/check_certificate.py verifies one, and
// shares no code with the analysis.
#pragma once

#include <string>

#include "runtime/plan.h"

namespace qduino::apps {

/// Contract: the plan is admitted.
[[nodiscard]] std::string certificate_json(const runtime::Plan& plan, const std::string& sketch);

}  // namespace qduino::apps
