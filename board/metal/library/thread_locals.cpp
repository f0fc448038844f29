#include "board/metal/library/thread_locals.h"

#include <cstddef>
#include <cstring>
#include <new>

#include "base/contract.h"
#include "board/metal/computer/processor.h"

// image.ld: where the image has them, how many bytes are not zero, how many there are, and of
// what their address is a multiple.
extern "C" std::uint8_t thread_locals[], thread_locals_filled[], thread_locals_size[],
    thread_locals_alignment[];

/// One whose place is checked: where it is off by some bytes, so are all.
extern "C" {
constinit thread_local std::uint32_t thread_locals_mark = 0x51d17a05;
}

namespace qduino::board::metal {

std::uint64_t make_thread_locals() {
    using Layout = ThreadLocalsLayout;
    const auto filled = reinterpret_cast<std::size_t>(thread_locals_filled);
    const auto alignment = reinterpret_cast<std::size_t>(thread_locals_alignment);
    const std::size_t size =
        (reinterpret_cast<std::size_t>(thread_locals_size) + alignment - 1) & ~(alignment - 1);
    const std::size_t below = Layout::below(size, alignment), all = below + Layout::above(size, alignment);
    auto* const begin = static_cast<std::uint8_t*>(operator new (all, std::align_val_t{alignment}));
    std::uint8_t* const at = begin + below;
    std::memset(begin, 0, all);
    std::memcpy(at + Layout::variables(size, alignment), thread_locals, filled);
    const auto self = reinterpret_cast<std::uint64_t>(at);
    std::memcpy(at, &self, sizeof self);

    std::uint32_t mark = 0;
    std::memcpy(&mark, at + Layout::of_mark(), sizeof mark);
    QDUINO_EXPECT(mark == 0x51d17a05);
    return self;
}

}  // namespace qduino::board::metal
