// The guard of debug builds: when a real-time loop that has begun allocates, frees or locks, it
// ends the program with the loop's number and the name of the call (board/real_time_mark.h says
// which loops, and why).
//
//   loop ──malloc──► here ── marked? ── no ──► glibc's
//                              └─ yes ──► "loop 2 called malloc …", its stack, abort()
//                                         ──► safe states (fatal_signals.h)
//
// It is part of an executable, never of a library: symbols of the executable come before those of
// libc (ld.so(8)), so calls from libstdc++ and libc itself come here too. glibc documents that
// malloc may be replaced in this way, and exports the original as __libc_malloc (glibc manual,
// "Replacing malloc"). pthread_mutex_lock has no such name: the guard looks up the next definition
// behind its own. pthread_mutex_trylock never waits and is left alone. Locks inside libc (stdio's)
// stay unseen, since libc does not look them up by name.
//
// It does not work with a sanitizer, which replaces the same functions (CMakeLists.txt).
#include <dlfcn.h>
#include <execinfo.h>
#include <malloc.h>
#include <pthread.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

#include "board/real_time_mark.h"

extern "C" {
void* __libc_malloc(std::size_t size);                           // NOLINT: glibc's names
void* __libc_calloc(std::size_t count, std::size_t size);        // NOLINT
void* __libc_realloc(void* memory, std::size_t size);            // NOLINT
void* __libc_memalign(std::size_t alignment, std::size_t size);  // NOLINT
void __libc_free(void* memory);                                  // NOLINT
}

namespace {

using qduino::board::real_time_mark;

void say(const char* text) { static_cast<void>(!::write(STDERR_FILENO, text, std::strlen(text))); }

void say_number(unsigned number) {
    char digits[4] = {};
    int at = sizeof digits - 1;
    do digits[--at] = static_cast<char>('0' + number % 10);
    while ((number /= 10) != 0 && at > 0);
    say(digits + at);
}

[[noreturn, gnu::cold, gnu::noinline]] void stop_the_loop(const char* what) {
    const unsigned loop = real_time_mark.loop;
    real_time_mark = {};  // what follows may allocate
    say(loop > qduino::board::kMaxLoop ? "I/O VCPU " : "loop ");
    say_number(loop);
    say(" called ");
    say(what);
    say(" after it had begun. A real-time loop allocates and locks nothing: allocate in setup(), lock with a "
        "Mutex, or do "
        "it in void loop(). Called from:\n");
    std::array<void*, 32> stack{};
    ::backtrace_symbols_fd(stack.data(), ::backtrace(stack.data(), stack.size()), STDERR_FILENO);
    std::abort();
}

inline void check(const char* what) {
    if (real_time_mark.loop == qduino::board::kNoVcpu || real_time_mark.allowed > 0) [[likely]]
        return;
    stop_the_loop(what);
}

/// The function of this name that the program would have without the guard.
template <typename Function>
Function* next(const char* name, std::atomic<Function*>& found) {
    Function* function = found.load(std::memory_order_relaxed);
    if (function) [[likely]]
        return function;
    function = reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
    if (!function) std::abort();
    found.store(function, std::memory_order_relaxed);
    return function;
}

void* allocate(std::size_t size, std::size_t alignment) {
    for (;;) {
        if (void* memory = alignment == 0 ? __libc_malloc(size) : __libc_memalign(alignment, size))
            return memory;
        const std::new_handler handler = std::get_new_handler();
        if (!handler) throw std::bad_alloc{};
        handler();
    }
}

}  // namespace

// ---- C ------------------------------------------------------------------------------------------

extern "C" {

void* malloc(std::size_t size) noexcept {
    check("malloc");
    return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) noexcept {
    check("calloc");
    return __libc_calloc(count, size);
}
void* realloc(void* memory, std::size_t size) noexcept {
    check("realloc");
    return __libc_realloc(memory, size);
}
void free(void* memory) noexcept {
    if (memory) check("free");
    __libc_free(memory);
}
void* memalign(std::size_t alignment, std::size_t size) noexcept {
    check("memalign");
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
    check("aligned_alloc");
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** memory, std::size_t alignment, std::size_t size) noexcept {
    check("posix_memalign");
    if (alignment < sizeof(void*) || (alignment & (alignment - 1)) != 0) return EINVAL;
    void* const got = __libc_memalign(alignment, size);
    if (!got) return ENOMEM;
    *memory = got;
    return 0;
}

int pthread_mutex_lock(pthread_mutex_t* mutex) noexcept {
    static std::atomic<int (*)(pthread_mutex_t*)> found{nullptr};
    check("pthread_mutex_lock");
    return next<int(pthread_mutex_t*)>("pthread_mutex_lock", found)(mutex);
}

}  // extern "C"

// ---- C++ ----------------------------------------------------------------------------------------
// The array and nothrow forms of libstdc++ call these.

void* operator new(std::size_t size) {
    check("operator new");
    return allocate(size, 0);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    check("operator new");
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
    if (memory) check("operator delete");
    __libc_free(memory);
}
void operator delete(void* memory, std::size_t) noexcept { ::operator delete(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { ::operator delete(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { ::operator delete(memory); }
