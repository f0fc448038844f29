#include "board/metal/library/thread_locals.h"

#include <cstddef>
#include <cstring>
#include <new>

#include "base/contract.h"

// boot/image.ld: where the image has them, how many bytes are not zero, how many there are, and of
// what their address is a multiple.
extern "C" std::uint8_t thread_locals[], thread_locals_filled[], thread_locals_size[],
    thread_locals_alignment[];

/// One whose place is checked: where it is off by some bytes, so are all.
extern "C" {
constinit thread_local std::uint32_t thread_locals_mark = 0x51d17a05;
}

namespace qduino::board::metal {

std::uint64_t make_thread_locals() {
    constexpr std::size_t kLibrary = 512;
    const auto filled = reinterpret_cast<std::size_t>(thread_locals_filled);
    const auto alignment = reinterpret_cast<std::size_t>(thread_locals_alignment);
    const std::size_t size =
        (reinterpret_cast<std::size_t>(thread_locals_size) + alignment - 1) & ~(alignment - 1);
    auto* const begin =
        static_cast<std::uint8_t*>(operator new (size + kLibrary, std::align_val_t{alignment}));
    std::memset(begin, 0, size + kLibrary);
    std::memcpy(begin, thread_locals, filled);
    const auto self = reinterpret_cast<std::uint64_t>(begin + size);
    std::memcpy(begin + size, &self, sizeof self);

    std::int64_t place = 0;
    asm("movq $thread_locals_mark@tpoff, %0" : "=r"(place));
    std::uint32_t mark = 0;
    std::memcpy(&mark, begin + size + place, sizeof mark);
    QDUINO_EXPECT(mark == 0x51d17a05);
    return self;
}

}  // namespace qduino::board::metal
