// Files that an emulator hands to its computer (QEMU's fw_cfg; docs/specs/fw_cfg.rst of QEMU).
//
//   0x510  ◄─ the number of a file (16 bits)
//   0x511  ─► its bytes, one by one
//
// File 0 is a signature, file 0x19 the list of the others.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace qduino::board::metal {

struct EmulatorFile {
    std::string name;
    std::shared_ptr<const std::string> bytes;
};

/// Those whose names begin with `prefix`, which is left out of their names. None elsewhere than in
/// QEMU. A byte takes as long as a read of a port.
[[nodiscard]] std::vector<EmulatorFile> emulator_files(std::string_view prefix);

}  // namespace qduino::board::metal
