// A program has this member exactly when its sketch declares chains (apps/sketch/sketch_main.cpp
// asks).
#include "arduino/core/chain.h"

#include "base/text.h"

namespace qduino::arduino {
namespace {

using runtime::Chain;

/// Each reason is said of the first mistake.
void refuse(Chain& chain, const char* why) {
    if (!chain.wrong) chain.wrong = why;
}

Chain::Words pin_words(int pin) { return text<Chain::Words>("pin ", pin); }

bool is_pin(int pin) { return pin >= 0 && pin < board::kPinCount; }

}  // namespace

void begin_chain(Chain& chain, Chain::Source source, int pin, const char* words) {
    if (chain.source != Chain::Source::none) refuse(chain, "it begins twice");
    chain.source = source;
    chain.from = words ? Chain::Words{words} : pin_words(pin);
    if (!is_pin(pin)) return refuse(chain, "a pin is 0 to 127");
    chain.pin = board::PinId{static_cast<std::uint16_t>(pin)};
    if (source != Chain::Source::device) return;
    for (int i = 0; i < board::kDeviceClassCount; ++i) {
        const auto device = static_cast<board::DeviceClass>(i);
        if (chain.from == board::kDeviceNames(device)) chain.device = device;
    }
    if (chain.device == board::DeviceClass::all)
        refuse(chain, "no such device: gpio, i2c, spi, uart, nic, disk");
}

void add_to_chain(Chain& chain, int loop, Nanoseconds pass, bool queued) {
    if (!is_loop_id(loop)) return refuse(chain, "a loop's number is 1 to 32");
    if (pass < Nanoseconds{0}) return refuse(chain, "a pass cannot last less than nothing");
    const sched::ChainStage stage{static_cast<board::VcpuId>(loop), pass, queued};
    if (!chain.stages.try_push_back(stage)) refuse(chain, "more than 8 stages");
}

void end_chain(Chain& chain, int pin, const char* words) {
    if (!is_pin(pin)) return refuse(chain, "a pin is 0 to 127");
    if (!chain.to.empty()) refuse(chain, "it ends twice");
    chain.to = words ? Chain::Words{words} : pin_words(pin);
}

void limit_chain(Chain& chain, Nanoseconds reaction, Nanoseconds age) {
    if (reaction + age <= Nanoseconds{0}) return refuse(chain, "a limit is more than 0");
    if (reaction > Nanoseconds{0}) chain.limits.reaction = reaction;
    if (age > Nanoseconds{0}) chain.limits.age = age;
}

}  // namespace qduino::arduino
