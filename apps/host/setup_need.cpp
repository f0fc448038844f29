#include "apps/host/setup_need.h"

#include "arduino/core/interrupts.h"

// A weak reference takes no member out of the Arduino archive. It is null unless the sketch, or a
// library that it uses, took that member.
namespace qduino::arduino {
[[gnu::weak]] bool interrupts_vcpu(DeviceClass device, Nanoseconds budget, Nanoseconds period, int core);
}

namespace qduino::apps {

bool setup_may_declare_vcpus() { return &arduino::interrupts_vcpu != nullptr; }

}  // namespace qduino::apps
