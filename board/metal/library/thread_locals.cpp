#include "board/metal/library/thread_locals.h"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <new>

// boot/image.ld: where the image has them, how many bytes are not zero, how many there are, and of
// what their address is a multiple.
extern "C" std::uint8_t thread_locals[], thread_locals_filled[], thread_locals_size[],
    thread_locals_alignment[];

namespace qduino::board::metal {

std::uint64_t make_thread_locals() {
    constexpr std::size_t kLibrary = 512;
    const auto filled = reinterpret_cast<std::size_t>(thread_locals_filled);
    const std::size_t alignment =
        std::max<std::size_t>(reinterpret_cast<std::size_t>(thread_locals_alignment), 16);
    const std::size_t size =
        (reinterpret_cast<std::size_t>(thread_locals_size) + alignment - 1) & ~(alignment - 1);
    auto* const begin =
        static_cast<std::uint8_t*>(operator new (size + kLibrary, std::align_val_t{alignment}));
    std::memset(begin, 0, size + kLibrary);
    std::memcpy(begin, thread_locals, filled);
    const auto self = reinterpret_cast<std::uint64_t>(begin + size);
    std::memcpy(begin + size, &self, sizeof self);
    return self;
}

}  // namespace qduino::board::metal
