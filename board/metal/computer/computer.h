// The computer around the cores: what the loader told, which cores there are, which devices. Each
// architecture has its own (x86/computer.cpp, aarch64/computer.cpp).
//
//   boot/boot_main.cpp   read_boot_facts ─► start_computer ─► open_devices ─► start_core …
//   the other core                                                            └─► join_computer
//   the program          lead_pins_to, let_cores_take_turns
//   panic.cpp            tell_emulator, end_computer
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "base/result.h"
#include "board/metal/boot/boot_facts.h"
#include "board/metal/core/core.h"

namespace qduino::board::metal {

/// `magic`, `told_at`: what the loader left in registers. `inside`: an address in the wanted range
/// of RAM. False: no loader that is known. Takes no memory; `facts` has to stay where it is.
[[nodiscard]] bool read_boot_facts(std::uint64_t magic, std::uint64_t told_at, std::uint64_t inside,
                                   BootFacts& facts);
/// On the first core, with exceptions told already: guard pages, interrupt controllers, the clock.
void start_computer(const BootFacts& facts);
void open_devices(const BootFacts& facts);

/// Their number, the first one included.
[[nodiscard]] std::size_t cores_in_computer();
/// Core `index` begins with core_main(), on core.boot_stack_top().
void start_core(std::size_t index, const Core& core);
/// Each other core calls it before anything else.
void join_computer();
/// What interrupts for the calling core are sent to.
[[nodiscard]] std::uint32_t own_target();

/// The pins are those of this device from now on, such as "lpt". Error: what there is not. Before
/// any loop.
[[nodiscard]] Result<void> lead_pins_to(std::string_view device);
/// Where an emulator's cores take turns: each of so many microseconds. False: not on this computer.
bool let_cores_take_turns(double turn_us);
/// Words for whoever started an emulator. False: nobody listens.
bool tell_emulator(std::string_view words);
/// Off, where that can be; otherwise the computer stands still.
[[noreturn]] void end_computer(int status);

}  // namespace qduino::board::metal
