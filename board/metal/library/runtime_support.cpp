// What a C++ compiler takes for granted, on a computer without exceptions and without an end of the
// program. The standard library would throw where it calls std::__throw_…; here that is a panic.
#include <cstdlib>
#include <exception>
#include <memory>
#include <stdexcept>

#include "board/metal/panic.h"

using qduino::board::metal::panic;

extern "C" {
void* __dso_handle = nullptr;
/// Static objects are never destroyed: the computer is turned off before.
int __cxa_atexit(void (*)(void*), void*, void*) { return 0; }
void __cxa_pure_virtual() { panic("a pure virtual function was called"); }
void abort() { panic("abort() was called"); }

// The compiler's library was compiled with exceptions. Nothing here throws one.
void __gxx_personality_v0() { panic("an exception was thrown"); }
void _Unwind_Resume(void*) { panic("an exception was thrown"); }
void* __cxa_allocate_exception(std::size_t) { panic("an exception was thrown"); }
void __cxa_free_exception(void*) {}
void __cxa_throw(void*, void*, void (*)(void*)) { panic("an exception was thrown"); }
void* __cxa_begin_catch(void*) { panic("an exception was thrown"); }
void __cxa_end_catch() {}
void __cxa_rethrow() { panic("an exception was thrown"); }
/// std::shared_ptr counts with plain additions where a program has one thread. This one has many.
char __libc_single_threaded = 0;
}

namespace std {

/// std::make_shared() asks for its own tag by its address, and then here, in case that another
/// library has a copy of it. There is none.
bool _Sp_make_shared_tag::_S_eq(const type_info&) noexcept { return false; }

void terminate() noexcept { panic("std::terminate() was called"); }

// A library that has classes of exceptions names these, and makes one where it would throw.
__cow_string::__cow_string() : _M_p(nullptr) {}
__cow_string::~__cow_string() {}
runtime_error::runtime_error(const char* what) { panic(what); }
runtime_error::~runtime_error() noexcept = default;
const char* runtime_error::what() const noexcept { return "an exception"; }

void __throw_length_error(const char* what) { panic(what); }
void __throw_logic_error(const char* what) { panic(what); }
void __throw_out_of_range(const char* what) { panic(what); }
void __throw_out_of_range_fmt(const char* what, ...) { panic(what); }
void __throw_invalid_argument(const char* what) { panic(what); }
void __throw_system_error(int) { panic("a system's call failed"); }
void __throw_bad_alloc() { panic("no memory is left"); }
void __throw_bad_array_new_length() { panic("an array of a negative or an immense size"); }
void __throw_bad_function_call() { panic("an empty std::function was called"); }
void __throw_bad_optional_access() { panic("an empty std::optional was read"); }
void __throw_bad_variant_access(const char* what) { panic(what); }

}  // namespace std
