// The C library's one way out. musl asks a system for what it cannot do itself by one instruction
// (`syscall`, `svc 0`), with Linux's numbers. This kernel answers three of them:
//
//   write, writev   standard output: Serial's line; standard error: beside it (panic.h), or there
//   exit_group      the computer is turned off
//
// and says "not implemented" to all others. So printf() works as it is, and what needs files or
// processes fails as the library says that it may. Clocks and waits do not come here (clocks.cpp).
// entry.S of the architecture calls this.
#include <cstdint>
#include <span>
#include <string_view>

#include "board/metal/computer/processor.h"
#include "board/metal/driver/serial_line.h"
#include "board/metal/panic.h"

namespace qduino::board::metal {
namespace {

constexpr std::int64_t kNotImplemented = -38, kBadDescriptor = -9;

struct Piece {  // Linux's struct iovec
    const char* begin;
    std::uint64_t size;
};

std::int64_t write(std::uint64_t descriptor, std::string_view text) {
    if (descriptor != 1 && descriptor != 2) return kBadDescriptor;
    std::span bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    if (descriptor == 2 && tell_beside(text)) bytes = {};
    while (!bytes.empty()) bytes = bytes.subspan(console_line.write(bytes));
    return static_cast<std::int64_t>(text.size());
}

std::int64_t write_pieces(std::uint64_t descriptor, std::span<const Piece> pieces) {
    std::int64_t written = 0;
    for (const Piece& piece : pieces) {
        const std::int64_t result = write(descriptor, {piece.begin, piece.size});
        if (result < 0) return result;
        written += result;
    }
    return written;
}

}  // namespace

}  // namespace qduino::board::metal

extern "C" std::int64_t system_call(std::uint64_t number, std::uint64_t first, std::uint64_t second,
                                    std::uint64_t third) {
    using namespace qduino::board::metal;
    switch (static_cast<SystemCall>(number)) {
        case SystemCall::write:
            return write(first, {reinterpret_cast<const char*>(second), third});
        case SystemCall::writev:
            return write_pieces(first, {reinterpret_cast<const Piece*>(second), third});
        case SystemCall::exit_group:
            turn_off(static_cast<int>(first));
        default:
            return kNotImplemented;
    }
}
