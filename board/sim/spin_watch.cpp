#include "board/sim/spin_watch.h"

#include <unwind.h>

#include <algorithm>
#include <span>

#include "board/sim/event_loop.h"

namespace qduino::board::sim {
namespace {

/// A look's worth of blocks at a nanosecond each, as on the computers that QduinoMC runs on.
constexpr Nanoseconds kFirstStep{kBlocksPerLook};
constexpr int kGrowth = 16;
/// Within so many bytes of a spin's place its own loop goes round.
constexpr std::uintptr_t kReach = 512;

_Unwind_Reason_Code keep_frame(_Unwind_Context* context, void* into) {
    CallStack& stack = *static_cast<CallStack*>(into);
    if (stack.depth == CallStack::kDepth) return _URC_END_OF_STACK;
    stack.address[stack.depth++] = reinterpret_cast<const void*>(_Unwind_GetIP(context));
    return _URC_NO_REASON;
}

/// The stack of the caller, from the frame of `place` outwards.
CallStack stack_from(const void* place) {
    CallStack all;
    _Unwind_Backtrace(&keep_frame, &all);
    const std::span<const void* const> frames = std::span(all.address).first(all.depth);
    CallStack stack{.address = {place}, .depth = 1};
    const auto from = std::ranges::find(frames, place);
    if (from != frames.end())
        stack.depth = static_cast<std::size_t>(std::copy(from, frames.end(), stack.address.begin()) -
                                               stack.address.begin());
    return stack;
}

}  // namespace

Spin& SpinWatch::spin_of_caller() { return loop_.current() ? loop_.current()->spin : setup_; }

bool SpinWatch::is_known(const Spin& spin, const void* place) const {
    if (spin.stack.depth == 0) return false;
    const auto here = reinterpret_cast<std::uintptr_t>(place);
    const auto there = reinterpret_cast<std::uintptr_t>(spin.stack.address[0]);
    return (here > there ? here - there : there - here) < kReach;
}

void SpinWatch::look(const void* place) {
    Spin& spin = spin_of_caller();
    if (spin.seen != loop_.now()) {  // time has passed since, and not by this
        spin.seen = spin.begun = loop_.now();
        spin.looks = 0;
        return;
    }
    const std::uint32_t free_looks = is_known(spin, place) ? 1 : config_.spin_limit / kBlocksPerLook;
    if (++spin.looks >= free_looks) charge(spin, place);
}

void SpinWatch::charge(Spin& spin, const void* place) {
    spin.stack = stack_from(place);
    loop_.spin_for(std::max(kFirstStep, (loop_.now() - spin.begun) / kGrowth));
    spin.seen = loop_.now();
    spin.lasted = spin.seen - spin.begun;
}

void SpinWatch::never_go_on(const void* place) {
    Spin& spin = spin_of_caller();
    spin.stack = stack_from(place);
    spin.stack.address[0] = static_cast<const char*>(place) + 1;  // as if it were a return address
    spin.endless = true;
    spin.begun = loop_.now();
    for (;;) loop_.spin_for(kForever - loop_.now());
}

std::vector<SpinSeen> SpinWatch::seen() const {
    std::vector<SpinSeen> found;
    const auto keep = [&](VcpuId id, const Spin& spin, bool goes_on) {
        if (spin.stack.depth == 0) return;
        found.push_back({id, goes_on, spin});
        if (goes_on) found.back().spin.lasted = loop_.now() - spin.begun;
    };
    keep(kNoVcpu, setup_, loop_.in_setup());
    loop_.cpus().each([&](const Vcpu& vcpu) { keep(vcpu.spec.id, vcpu.spin, vcpu.spinning); });
    return found;
}

}  // namespace qduino::board::sim
