#include "report/crash_report.h"

#include <execinfo.h>
#include <sched.h>
#include <ucontext.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>

#include "base/text.h"
#include "report/code_place.h"
#include "runtime/plan.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

/// What a handler was told.
struct Crash {
    int signal = 0;
    const void* address = nullptr;        ///< si_addr: that was followed
    const void* instruction = nullptr;    ///< that did it; null: unknown
    const void* stack_pointer = nullptr;  ///< there
};

constexpr std::uintptr_t kNullPage = 64 * 1024;
/// So far from the stack pointer a full stack is noticed: a page of guard, and one frame.
constexpr std::uintptr_t kNearStack = 256 * 1024;

constexpr unsigned kPatienceSeconds = 5;
volatile std::sig_atomic_t died_of = SIGABRT;

void die_without_words(int) {
    std::signal(died_of, SIG_DFL);
    sigset_t waiting;
    sigemptyset(&waiting);
    sigaddset(&waiting, died_of);
    ::sigprocmask(SIG_UNBLOCK, &waiting, nullptr);
    std::raise(died_of);
    ::_exit(1);
}

std::uintptr_t number_of(const void* address) { return reinterpret_cast<std::uintptr_t>(address); }

bool is_near(const void* a, const void* b) {
    const std::uintptr_t x = number_of(a), y = number_of(b);
    return (x > y ? x - y : y - x) < kNearStack;
}

std::string cause_of_fault(const Crash& crash) {
    if (crash.stack_pointer && is_near(crash.address, crash.stack_pointer))
        return "its stack is full. Make large local arrays static or global, and look for a function "
               "that calls itself for ever";
    if (number_of(crash.address) < kNullPage)
        return text<std::string>("it follows a null pointer, to address ", number_of(crash.address),
                                 ". An AVR reads what stands there; test the pointer first");
    return "it follows a pointer to memory that is not there. Look for an index beyond its array, and "
           "for an object that is gone";
}

const char* name_of(int signal) {
    switch (signal) {
        case SIGFPE:
            return "SIGFPE";
        case SIGILL:
            return "SIGILL";
        case SIGABRT:
            return "SIGABRT";
        case SIGBUS:
            return "SIGBUS";
        default:
            return "SIGSEGV";
    }
}

Crash crash_of(int signal, const siginfo_t* info, const void* context) {
    Crash crash{.signal = signal, .address = info->si_addr};
    [[maybe_unused]] const auto& machine = static_cast<const ucontext_t*>(context)->uc_mcontext;
#if defined(__x86_64__)
    crash.instruction = reinterpret_cast<const void*>(machine.gregs[REG_RIP]);
    crash.stack_pointer = reinterpret_cast<const void*>(machine.gregs[REG_RSP]);
#elif defined(__aarch64__)
    crash.instruction = reinterpret_cast<const void*>(machine.pc);
    crash.stack_pointer = reinterpret_cast<const void*>(machine.sp);
#endif
    return crash;
}

std::string place_of_crash(const Crash& crash) {
    std::array<void*, 64> frames{};
    const auto count =
        static_cast<std::size_t>(std::max(0, ::backtrace(frames.data(), static_cast<int>(frames.size()))));
    auto* const end = frames.begin() + count;
    // What is further in is this handler.
    auto* begin = std::find(frames.begin(), end, crash.instruction);
    std::array<const void*, 64> stack{};
    std::size_t depth = 0;
    // place_of() takes return addresses, which are behind the call.
    if (crash.instruction) stack[depth++] = static_cast<const char*>(crash.instruction) + 1;
    for (begin = begin == end ? end : begin + 1; begin != end && depth < stack.size(); ++begin)
        stack[depth++] = *begin;
    return place_of(std::span(stack).first(depth));
}

/// What it did, and what to do about it.
std::string cause_of(const Crash& crash) {
    switch (crash.signal) {
        case SIGFPE:
            return "it divides by zero. An AVR goes on there with a number that means nothing; test the "
                   "divisor first";
        case SIGILL:
            return "it came to a place that the compiler takes for unreachable. Look for a function that "
                   "ends without its return";
        case SIGABRT:
            return "it, or a library that it called, gave up with abort()";
        default:
            return cause_of_fault(crash);
    }
}

}  // namespace

std::string name_of_vcpu(board::VcpuId vcpu) {
    if (vcpu == board::kNoVcpu) return "setup()";
    return (vcpu >= board::kFirstIoVcpu ? "a handler on " : "") + runtime::vcpu_name(vcpu);
}

void say_crash(const std::string& who, int signal, const siginfo_t* info, const void* context) {
    // Others of this core go on meanwhile.
    const sched_param none{};
    static_cast<void>(::sched_setscheduler(0, SCHED_OTHER, &none));
    // Without words, then, and still of the signal that it was.
    died_of = signal;
    std::signal(SIGALRM, die_without_words);
    ::alarm(kPatienceSeconds);
    const Crash crash = crash_of(signal, info, context);
    say(verdict(text<std::string>(who, " died at ", place_of_crash(crash), " (", name_of(signal),
                                  "): ", cause_of(crash), ".")));
    ::alarm(0);
}

void prepare_crash_words() {
    std::array<void*, 1> here{};
    if (::backtrace(here.data(), 1) == 1) static_cast<void>(place_of(std::array<const void*, 1>{here[0]}));
}

}  // namespace qduino::apps
