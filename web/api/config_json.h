// What the page needs to know of the machine (docs/api.md, GET /api/v1/config).
#pragma once

#include <string>
#include <string_view>

#include "printer/machine_config.h"

namespace qduino::web::api {

[[nodiscard]] std::string config_json(const printer::MachineConfig& machine, std::string_view version);

}  // namespace qduino::web::api
