// The real pins that a PC may have, by the loader's word pins=… (lead_pins_to()).
//
//   lpt              the first parallel port
//   baytrail         pads of Bay Trail; the bridge to the old devices tells where
//   apollolake-n     those of one community of Apollo Lake: -n, -nw, -w, -sw. Where the sideband's
//                    device is hidden, as firmwares leave it, they are where these firmwares put it
#include <algorithm>
#include <array>

#include "board/metal/computer/computer.h"
#include "board/metal/computer/instructions.h"
#include "board/metal/driver/intel_pads.h"
#include "board/metal/driver/lpt_port.h"
#include "board/metal/driver/pci.h"
#include "board/metal/linux_side.h"
#include "board/metal/pins.h"

namespace qduino::board::metal {
namespace {

constexpr std::uint16_t kIntel = 0x8086;

Result<PinPort*> parallel_port() {
    static LptPort port({port_write, port_read});
    if (port.open()) return &port;
    return make_error(ErrorCode::unavailable, "pins=lpt: no parallel port answers at 0x378");
}

/// The bridge's register has the address of the I/O controller in its upper bits.
Result<PinPort*> bay_trail() {
    constexpr std::uint16_t kBridge = 0x0f1c;
    constexpr std::uint8_t kControllerAt = 0x4c;
    const auto bridge = PciDevice::find(kIntel, kBridge);
    if (!bridge) return make_error(ErrorCode::unavailable, "pins=baytrail: this is no Bay Trail");
    static BayTrailPads pads({memory_write, memory_read}, bridge->read(kControllerAt) & ~0x3fffu);
    return &pads;
}

struct Community {
    std::string_view word;
    std::uint8_t port;  // of the sideband
    std::uint16_t pads;
};
constexpr std::array<Community, 4> kCommunities{{{"apollolake-n", 0xc5, 78},
                                                 {"apollolake-nw", 0xc4, 77},
                                                 {"apollolake-w", 0xc7, 47},
                                                 {"apollolake-sw", 0xc0, 43}}};

Result<PinPort*> apollo_lake(const Community& community) {
    constexpr std::uint16_t kHost = 0x5af0, kSideband = 0x5a92;
    constexpr std::uint64_t kUsualSideband = 0xd000'0000;
    if (!PciDevice::find(kIntel, kHost))
        return make_error(ErrorCode::unavailable, "pins=", community.word, ": this is no Apollo Lake");
    const auto sideband = PciDevice::find(kIntel, kSideband);
    const std::uint64_t ports = sideband ? sideband->read(0x10) & ~0xfu : kUsualSideband;
    static ApolloLakePads pads({memory_write, memory_read}, ports + (std::uint64_t{community.port} << 16),
                               community.pads);
    return &pads;
}

Result<PinPort*> port_of(std::string_view device) {
    if (device == "lpt") return parallel_port();
    if (device == "baytrail") return bay_trail();
    const auto* const found = std::ranges::find(kCommunities, device, &Community::word);
    if (found != kCommunities.end()) return apollo_lake(*found);
    return make_error(ErrorCode::invalid_argument, "pins=", device,
                      ": this board knows lpt, baytrail and apollolake-n, -nw, -w, -sw");
}

}  // namespace

Result<void> lead_pins_to(std::string_view device) {
    if (linux_side.exists())
        return make_error(ErrorCode::unsupported, "pins=", device,
                          ": beside Linux, ports and pads are Linux's");
    QDUINO_TRY_ASSIGN(PinPort* const port, port_of(device));
    pins.lead_to(*port);
    return {};
}

}  // namespace qduino::board::metal
