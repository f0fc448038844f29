#include "board/metal/library/system_calls.h"

#include <cstdint>
#include <span>
#include <string_view>

#include "board/metal/driver/serial_line.h"
#include "board/metal/machine/instructions.h"
#include "board/metal/panic.h"

extern "C" void system_call_entry();  // boot/entry.S

namespace qduino::board::metal {
namespace {

/// Linux, arch/x86/entry/syscalls/syscall_64.tbl.
enum Number : std::uint64_t { kWrite = 1, kWritev = 20, kExitGroup = 231 };
constexpr std::int64_t kNotImplemented = -38, kBadDescriptor = -9;

struct Piece {  // Linux's struct iovec
    const char* begin;
    std::uint64_t size;
};

std::int64_t write(std::uint64_t descriptor, std::string_view text) {
    if (descriptor == 2) {
        report(text);
    } else if (descriptor == 1) {
        std::span bytes(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
        while (!bytes.empty()) bytes = bytes.subspan(console_line.write(bytes));
    } else {
        return kBadDescriptor;
    }
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

/// Intel SDM volume 3, 5.8.8.
void accept_system_calls() {
    constexpr std::uint32_t kStar = 0xc0000081, kLongStar = 0xc0000082, kFlagMask = 0xc0000084;
    constexpr std::uint64_t kSelectors = 0x08;  // code; data is the next
    msr_write(kStar, kSelectors << 32);
    msr_write(kLongStar, reinterpret_cast<std::uint64_t>(&system_call_entry));
    msr_write(kFlagMask, 0);
}

}  // namespace qduino::board::metal

extern "C" std::int64_t system_call(std::uint64_t number, std::uint64_t first, std::uint64_t second,
                                    std::uint64_t third) {
    using namespace qduino::board::metal;
    switch (number) {
        case kWrite:
            return write(first, {reinterpret_cast<const char*>(second), third});
        case kWritev:
            return write_pieces(first, {reinterpret_cast<const Piece*>(second), third});
        case kExitGroup:
            turn_off(static_cast<int>(first));
        default:
            return kNotImplemented;
    }
}
