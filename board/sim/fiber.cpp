#include "board/sim/fiber.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <new>

#include "base/contract.h"

#if defined(__has_feature)
#define QDUINO_HAS_FEATURE(x) __has_feature(x)
#else
#define QDUINO_HAS_FEATURE(x) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || QDUINO_HAS_FEATURE(address_sanitizer)
#define QDUINO_FIBER_ASAN 1
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#else
#define QDUINO_FIBER_ASAN 0
#endif
#if defined(__SANITIZE_THREAD__) || QDUINO_HAS_FEATURE(thread_sanitizer)
#define QDUINO_FIBER_TSAN 1
#include <sanitizer/tsan_interface.h>
#else
#define QDUINO_FIBER_TSAN 0
#endif

// 1 where no switch is written for the processor; a test sets it to try the other way on any.
#if !defined(QDUINO_FIBER_UCONTEXT)
#if defined(__x86_64__) || defined(__aarch64__)
#define QDUINO_FIBER_UCONTEXT 0
#else
#define QDUINO_FIBER_UCONTEXT 1
#endif
#endif
#if QDUINO_FIBER_UCONTEXT
#include <ucontext.h>
#endif

// ---- the switch itself --------------------------------------------------------------------------
// void qduino_fiber_switch(void** save, void* load): pushes the callee-saved registers, stores the
// stack pointer in *save, takes `load` for stack pointer, pops the registers found there and
// returns to who saved them. qduino_fiber_begin is where a new fiber "returns" to: it moves the
// fiber's address into the argument register.

#if QDUINO_FIBER_UCONTEXT
#elif defined(__x86_64__)
asm(R"(
.text
.p2align 4
.globl qduino_fiber_switch
.hidden qduino_fiber_switch
.type qduino_fiber_switch, @function
qduino_fiber_switch:
    pushq %rbp
    pushq %rbx
    pushq %r12
    pushq %r13
    pushq %r14
    pushq %r15
    movq %rsp, (%rdi)
    movq %rsi, %rsp
    popq %r15
    popq %r14
    popq %r13
    popq %r12
    popq %rbx
    popq %rbp
    ret
.size qduino_fiber_switch, .-qduino_fiber_switch
.p2align 4
.globl qduino_fiber_begin
.hidden qduino_fiber_begin
.type qduino_fiber_begin, @function
qduino_fiber_begin:
    .cfi_startproc
    .cfi_undefined rip
    movq %r12, %rdi
    callq *%r13
    ud2
    .cfi_endproc
.size qduino_fiber_begin, .-qduino_fiber_begin
)");
#elif defined(__aarch64__)
asm(R"(
.text
.p2align 4
.globl qduino_fiber_switch
.hidden qduino_fiber_switch
.type qduino_fiber_switch, %function
qduino_fiber_switch:
    sub sp, sp, #160
    stp x19, x20, [sp, #0]
    stp x21, x22, [sp, #16]
    stp x23, x24, [sp, #32]
    stp x25, x26, [sp, #48]
    stp x27, x28, [sp, #64]
    stp x29, x30, [sp, #80]
    stp d8, d9, [sp, #96]
    stp d10, d11, [sp, #112]
    stp d12, d13, [sp, #128]
    stp d14, d15, [sp, #144]
    mov x9, sp
    str x9, [x0]
    mov sp, x1
    ldp x19, x20, [sp, #0]
    ldp x21, x22, [sp, #16]
    ldp x23, x24, [sp, #32]
    ldp x25, x26, [sp, #48]
    ldp x27, x28, [sp, #64]
    ldp x29, x30, [sp, #80]
    ldp d8, d9, [sp, #96]
    ldp d10, d11, [sp, #112]
    ldp d12, d13, [sp, #128]
    ldp d14, d15, [sp, #144]
    add sp, sp, #160
    ret
.size qduino_fiber_switch, .-qduino_fiber_switch
.p2align 4
.globl qduino_fiber_begin
.hidden qduino_fiber_begin
.type qduino_fiber_begin, %function
qduino_fiber_begin:
    .cfi_startproc
    .cfi_undefined x30
    mov x0, x19
    blr x20
    brk #1
    .cfi_endproc
.size qduino_fiber_begin, .-qduino_fiber_begin
)");
#endif

#if !QDUINO_FIBER_UCONTEXT
extern "C" void qduino_fiber_switch(void** save, void* load);
extern "C" void qduino_fiber_begin();
#endif

namespace qduino::board::sim {

struct Fiber::Machine {
#if QDUINO_FIBER_UCONTEXT
    ucontext_t host_context;
    ucontext_t fiber_context;
#else
    void* host_stack_pointer = nullptr;
    void* fiber_stack_pointer = nullptr;
#endif
#if QDUINO_FIBER_ASAN
    void* fake_stack = nullptr;
    const void* host_stack_bottom = nullptr;
    std::size_t host_stack_bytes = 0;
    const void* stack_bottom = nullptr;
    std::size_t stack_bytes = 0;
#endif
#if QDUINO_FIBER_TSAN
    void* host_tsan = nullptr;
    void* fiber_tsan = nullptr;
#endif
};

void fiber_started(Fiber* self) { Fiber::run_entry(self); }

namespace {

#if QDUINO_FIBER_UCONTEXT
// makecontext passes ints: a pointer travels in two halves.
void ucontext_entry(unsigned high, unsigned low) {
    fiber_started(reinterpret_cast<Fiber*>((static_cast<std::uintptr_t>(high) << 16 << 16) | low));
}
#elif defined(__x86_64__)
// What qduino_fiber_switch will pop, lowest address first: r15 r14 r13 r12 rbx rbp, then the return
// address. The stack is 16-byte aligned at the call in qduino_fiber_begin (psABI §3.2.2): seven
// words are popped, nine are taken.
void* first_frame(std::byte* top, Fiber* self) {
    auto* frame = reinterpret_cast<void**>(top) - 9;
    frame[2] = reinterpret_cast<void*>(&fiber_started);       // r13
    frame[3] = self;                                          // r12
    frame[6] = reinterpret_cast<void*>(&qduino_fiber_begin);  // return address
    return frame;
}
#else
void* first_frame(std::byte* top, Fiber* self) {
    auto* frame = reinterpret_cast<void**>(top - 160);
    frame[0] = self;                                           // x19
    frame[1] = reinterpret_cast<void*>(&fiber_started);        // x20
    frame[11] = reinterpret_cast<void*>(&qduino_fiber_begin);  // x30
    return frame;
}
#endif

}  // namespace

Fiber::Fiber(Entry entry, void* argument, std::size_t stack_bytes) : entry_(entry), argument_(argument) {
    QDUINO_EXPECT(entry != nullptr);
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    const std::size_t usable = (stack_bytes + sizeof(Machine) + page - 1) / page * page;
    mapping_bytes_ = usable + page;
    void* mapping = ::mmap(nullptr, mapping_bytes_, PROT_READ | PROT_WRITE,
                           MAP_PRIVATE | MAP_ANONYMOUS | MAP_STACK, -1, 0);
    if (mapping == MAP_FAILED) throw std::bad_alloc{};
    mapping_ = static_cast<std::byte*>(mapping);
    // An overflow faults here instead of spoiling a neighbour.
    ::mprotect(mapping_, page, PROT_NONE);

    const std::size_t machine_bytes = (sizeof(Machine) + 63) / 64 * 64;
    std::byte* top = mapping_ + mapping_bytes_ - machine_bytes;
    machine_ = new (top) Machine{};
#if QDUINO_FIBER_ASAN
    machine_->stack_bottom = mapping_ + page;
    machine_->stack_bytes = static_cast<std::size_t>(top - (mapping_ + page));
    // An abandoned fiber that was mapped here before may have left poisoned frames.
    __asan_unpoison_memory_region(mapping_ + page, usable);
#endif
#if QDUINO_FIBER_TSAN
    machine_->fiber_tsan = __tsan_create_fiber(0);
#endif
#if QDUINO_FIBER_UCONTEXT
    ::getcontext(&machine_->fiber_context);
    machine_->fiber_context.uc_stack.ss_sp = mapping_ + page;
    machine_->fiber_context.uc_stack.ss_size = static_cast<std::size_t>(top - (mapping_ + page));
    machine_->fiber_context.uc_link = nullptr;
    const auto address = reinterpret_cast<std::uintptr_t>(this);
    ::makecontext(&machine_->fiber_context, reinterpret_cast<void (*)()>(&ucontext_entry), 2,
                  static_cast<unsigned>(address >> 16 >> 16), static_cast<unsigned>(address));
#else
    machine_->fiber_stack_pointer = first_frame(top, this);
#endif
}

Fiber::~Fiber() {
#if QDUINO_FIBER_TSAN
    __tsan_destroy_fiber(machine_->fiber_tsan);
#endif
    ::munmap(mapping_, mapping_bytes_);
}

void Fiber::resume() {
    QDUINO_EXPECT(!finished_);
#if QDUINO_FIBER_ASAN
    void* host_fake_stack = nullptr;
    __sanitizer_start_switch_fiber(&host_fake_stack, machine_->stack_bottom, machine_->stack_bytes);
#endif
#if QDUINO_FIBER_TSAN
    machine_->host_tsan = __tsan_get_current_fiber();
    __tsan_switch_to_fiber(machine_->fiber_tsan, 0);
#endif
#if QDUINO_FIBER_UCONTEXT
    ::swapcontext(&machine_->host_context, &machine_->fiber_context);
#else
    qduino_fiber_switch(&machine_->host_stack_pointer, machine_->fiber_stack_pointer);
#endif
#if QDUINO_FIBER_ASAN
    __sanitizer_finish_switch_fiber(host_fake_stack, nullptr, nullptr);
#endif
}

void Fiber::suspend() {
#if QDUINO_FIBER_ASAN
    // A null save slot tells the sanitizer that this stack will never be returned to.
    __sanitizer_start_switch_fiber(finished_ ? nullptr : &machine_->fake_stack, machine_->host_stack_bottom,
                                   machine_->host_stack_bytes);
#endif
#if QDUINO_FIBER_TSAN
    __tsan_switch_to_fiber(machine_->host_tsan, 0);
#endif
#if QDUINO_FIBER_UCONTEXT
    ::swapcontext(&machine_->fiber_context, &machine_->host_context);
#else
    qduino_fiber_switch(&machine_->fiber_stack_pointer, machine_->host_stack_pointer);
#endif
#if QDUINO_FIBER_ASAN
    __sanitizer_finish_switch_fiber(machine_->fake_stack, &machine_->host_stack_bottom,
                                    &machine_->host_stack_bytes);
#endif
}

void Fiber::run_entry(Fiber* self) {
#if QDUINO_FIBER_ASAN
    __sanitizer_finish_switch_fiber(nullptr, &self->machine_->host_stack_bottom,
                                    &self->machine_->host_stack_bytes);
#endif
    self->entry_(self->argument_);
    self->finished_ = true;
    self->suspend();
}

}  // namespace qduino::board::sim
