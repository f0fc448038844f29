// Whose line it is that loop 1 carries out.
#pragma once

#include <cstdint>

namespace qduino::printer::machine {

enum class Speaker : std::uint8_t {
    job,     ///< a job's: what it asks for happens at its place in the motion
    person,  ///< typed: it happens at once, unless it moves
    host,    ///< of a serial host: as a job's, but answered to the host
};

}  // namespace qduino::printer::machine
