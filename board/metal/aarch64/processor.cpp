#include "board/metal/computer/processor.h"

#include "board/metal/computer/core_interrupts.h"

extern "C" {
using qduino::board::metal::Frame;
Frame* enter_kernel(const Frame* frame);
/// aarch64/entry.S: an exception of the kind that the table of vectors has at this place.
Frame* take_exception(Frame* frame, std::uint64_t kind);
}

namespace qduino::board::metal {
namespace {

enum Kind : std::uint64_t { kSynchronous = 0, kIrq = 1, kFiq = 2, kSystemError = 3 };
// Exceptions of the processor, as vectors; 2 is kStopVector.
constexpr std::uint64_t kSynchronousVector = 0, kSystemErrorVector = 3;

/// The class of an exception, and what belongs to it: Arm ARM, ESR_EL1.
std::uint64_t class_of(std::uint64_t syndrome) { return syndrome >> 26 & 0x3f; }
constexpr std::uint64_t kSvc = 0x15;

std::uint64_t vector_of(std::uint64_t syndrome) {
    const bool switches = class_of(syndrome) == kSvc && (syndrome & 0xffff) == kSwitchVector;
    return switches ? kSwitchVector : kSynchronousVector;
}

}  // namespace

void Frame::begin(void (*entry)(void*), void* argument, std::uint64_t top) {
    constexpr std::uint64_t kOwnStackNothingMasked = 4;  // EL1t
    *this = {};
    link = reinterpret_cast<std::uint64_t>(entry);
    registers[0] = reinterpret_cast<std::uint64_t>(argument);
    sp = top;
    state = kOwnStackNothingMasked;
}

void Processor::open(void* core) {
    core_ = core;
    panic_stack_top_ = reinterpret_cast<std::uint64_t>(panic_stack_.data() + kPanicStack);
    QDUINO_WRITE_SYSTEM(tpidr_el1, reinterpret_cast<std::uint64_t>(this));
    asm volatile("msr daifclr, #5" : : : "memory");  // system errors, and FIQ: the order to stop
}

bool is_about_memory(const Frame& frame, std::uint64_t& address) {
    constexpr std::uint64_t kFetch = 0x21, kAccess = 0x25;  // aborts, from the same level
    const std::uint64_t kind = class_of(frame.error);
    if (frame.vector != kSynchronousVector || (kind != kFetch && kind != kAccess)) return false;
    address = QDUINO_READ_SYSTEM(far_el1);
    return true;
}

/// Arm ARM, ESR_EL1, field EC.
std::string_view exception_name(const Frame& frame) {
    if (frame.vector == kStopVector) return "order to stop";
    if (frame.vector == kSystemErrorVector) return "system error";
    switch (class_of(frame.error)) {
        case 0x00:
            return "invalid opcode";
        case 0x07:
            return "no floating point";
        case 0x0e:
            return "illegal state";
        case 0x15:
            return "unknown call";
        case 0x18:
            return "system register";
        case 0x21:
            return "page fault (code)";
        case 0x22:
            return "misaligned code";
        case 0x25:
            return "page fault";
        case 0x26:
            return "misaligned stack";
        case 0x3c:
            return "breakpoint";
        default:
            return "exception";
    }
}

}  // namespace qduino::board::metal

Frame* take_exception(Frame* frame, std::uint64_t kind) {
    using namespace qduino::board::metal;
    frame->error = QDUINO_READ_SYSTEM(esr_el1);
    if (kind == kIrq || kind == kFiq)
        CoreInterrupts::acknowledge(*frame);
    else
        frame->vector = kind == kSystemError ? kSystemErrorVector : vector_of(frame->error);
    return enter_kernel(frame);
}
