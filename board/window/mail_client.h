// The asking side of a mailbox (pins_layout.h): a request goes in, and an answer is read once
// `reply` has the request's sequence number. How to wait for that is each board's business.
#pragma once

#include <algorithm>
#include <array>
#include <cstring>
#include <span>
#include <string_view>

#include "base/result.h"
#include "board/window/mail_words.h"
#include "board/window/pins_layout.h"

namespace qduino::board {

/// Writes a request into the mailbox and returns its sequence number. By the mailbox' own VCPU.
inline std::uint32_t post_request(Mailbox& mail, const MailHead& head, std::span<const std::uint8_t> out) {
    const std::uint32_t even = (mail.request.load(std::memory_order_relaxed) + 1) & ~1u;
    mail.request.store(even + 1, std::memory_order_relaxed);  // odd: being written
    std::array<std::uint8_t, sizeof head> bytes{};
    std::memcpy(bytes.data(), &head, sizeof head);
    store_words(mail.head, bytes);
    store_words(mail.out, out);
    mail.request.store(even + 2, std::memory_order_release);
    return even + 2;
}

/// The machine's answer to a transaction: success, or its error with its words.
inline Result<void> what_machine_said(const Mailbox& mail) {
    const std::uint32_t failed = mail.failed.load(std::memory_order_relaxed);
    if (failed == 0) return {};
    std::array<std::uint8_t, decltype(Error::message)::kCapacity> text{};
    const std::size_t size =
        std::min<std::size_t>(mail.text_size.load(std::memory_order_relaxed), text.size());
    load_words(mail.in, {text.data(), size});
    constexpr auto kLast = static_cast<std::uint32_t>(ErrorCode::internal);
    return make_error(static_cast<ErrorCode>(std::min(failed - 1, kLast)),
                      std::string_view{reinterpret_cast<const char*>(text.data()), size});
}

/// A request's head; its sizes are put in by with_sizes(). Error: out_of_range above kMailBytes.
[[nodiscard]] inline Result<MailHead> with_sizes(MailHead head, std::size_t out, std::size_t in) {
    if (out > kMailBytes || in > kMailBytes)
        return make_error(ErrorCode::out_of_range,
                          "a bus transaction carries at most 1024 bytes each way: split it");
    head.out_size = static_cast<std::uint16_t>(out);
    head.in_size = static_cast<std::uint16_t>(in);
    return head;
}

[[nodiscard]] inline MailHead i2c_request(I2cBus bus, I2cAddress address) {
    return {.kind = MailKind::i2c, .bus = bus.number, .address = address.value};
}
[[nodiscard]] inline MailHead spi_request(SpiBus bus, SpiSettings settings) {
    return {.kind = MailKind::spi,
            .bus = bus.number,
            .spi_mode = settings.mode,
            .spi_clock_hz = settings.clock_hz,
            .spi_lsb_first = static_cast<std::uint8_t>(settings.least_significant_first ? 1 : 0)};
}

}  // namespace qduino::board
