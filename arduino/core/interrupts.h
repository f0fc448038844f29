// Interrupts and isolation: Arduino's calls, and QduinoMC's by device class, core and budget.
//
// An interrupt's handler here is a thread on a budgeted I/O VCPU. It steals no CPU from a loop, and
// may call everything that a loop may.
#pragma once

#include "arduino/core/loops.h"
#include "arduino/core/wiring.h"
#include "runtime/sketch.h"

namespace qduino::arduino {

using runtime::DeviceClass;

/// The device words of noInterrupts(ALL, 1), interruptsVcpu(I2C, 1, 100). The macros look them up
/// here, so that a sketch may have an SPI object and a variable DISK of its own.
namespace device_class {
inline constexpr DeviceClass GPIO = DeviceClass::gpio;
inline constexpr DeviceClass I2C = DeviceClass::i2c;
inline constexpr DeviceClass SPI = DeviceClass::spi;
inline constexpr DeviceClass UART = DeviceClass::uart;
inline constexpr DeviceClass NIC = DeviceClass::nic;
inline constexpr DeviceClass DISK = DeviceClass::disk;
inline constexpr DeviceClass ALL = DeviceClass::all;
}  // namespace device_class

bool attach_interrupt_vcpu(int pin, void (*handler)(), int mode, Nanoseconds budget, Nanoseconds period,
                           int core);
bool interrupts_vcpu(DeviceClass device, Nanoseconds budget, Nanoseconds period, int core);

}  // namespace qduino::arduino

// ---- QduinoMC: true when the board granted it; a refusal is reported ----------------------------
/// Routes the interrupts of a device class away from `core`, and back.
bool noInterrupts(qduino::arduino::DeviceClass device, int core);
bool interrupts(qduino::arduino::DeviceClass device, int core);
/// No scheduling tick and no scheduler on `core`, and back. The loop that has the core to itself
/// owns it: nobody keeps its budget. In setup() that may be any loop that names the core, if
/// nothing else does; later one whose budget is its period.
bool noTimer(int core);
bool reTimer(int core);

/// interruptsVcpu(device, budget, period [, core]): the I/O VCPU of a device class's bottom half.
/// In setup() it makes one. Called again from a loop or a handler, by the same name, it gives it
/// another budget and period; its core stays. False when the loops there would not be admitted
/// then: nothing is changed. The unit of plain numbers is TIME_UNIT's (the macro passes it).
template <typename Budget, typename Period>
bool interruptsVcpu(qduino::arduino::TimeUnit unit, qduino::arduino::DeviceClass device, Budget budget,
                    Period period, int core = qduino::runtime::kAnyCore) {
    using qduino::arduino::to_duration;
    return qduino::arduino::interrupts_vcpu(device, to_duration(unit, budget), to_duration(unit, period),
                                            core);
}
/// attachInterruptVcpu(pin, handler, mode, budget, period [, core]): a handler with an I/O VCPU of
/// its own. Setup-time.
template <typename Budget, typename Period>
bool attachInterruptVcpu(qduino::arduino::TimeUnit unit, int pin, void (*handler)(), int mode, Budget budget,
                         Period period, int core = qduino::runtime::kAnyCore) {
    using qduino::arduino::to_duration;
    return qduino::arduino::attach_interrupt_vcpu(pin, handler, mode, to_duration(unit, budget),
                                                  to_duration(unit, period), core);
}
