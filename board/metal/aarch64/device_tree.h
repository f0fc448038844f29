// The device tree: which devices a computer has, as its firmware tells it.
//
//   header ─► a list of words:  begin "cpus"  ── begin "cpu@0"  property reg = 0  end … end
//
// All words are big-endian. Devicetree Specification 0.4, chapter 5 (the flattened format), 2.3
// (standard properties), 3.8 (cpus).
#pragma once

#include <cstdint>
#include <string_view>

#include "base/fixed_vector.h"
#include "board/metal/computer/core_interrupts.h"

namespace qduino::board::metal {

inline constexpr std::uint32_t kDeviceTreeMagic = 0xd00dfeed;

/// Where the registers of a device are, and its interrupt: one of those that cores share.
struct DevicePlace {
    std::uint64_t at = 0;  ///< 0: there is no such device
    std::uint8_t line = 0;
};

struct DeviceTree {
    std::string_view words;                       ///< /chosen/bootargs, within the tree
    std::uint64_t ram_begin = 0, ram_end = 0;     ///< of the first region
    FixedVector<std::uint64_t, kCoresMax> cores;  ///< MPIDR_EL1 of each
    bool psci_by_smc = false;
    std::uint64_t gic_distributor = 0, gic_cpu = 0;
    DevicePlace uart, gpio, clock;  ///< a PL011, a PL061, a PL031: the first of each
};

/// False: there is no tree at `at`. Takes no memory.
[[nodiscard]] bool read_device_tree(std::uint64_t at, DeviceTree& tree);

}  // namespace qduino::board::metal
