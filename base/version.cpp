#include "base/version.h"

namespace qduino {

std::string_view version() { return QDUINO_VERSION; }

}  // namespace qduino
