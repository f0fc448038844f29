#include "board/linux/pin/pins_server.h"

#include <signal.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>

#include "base/whole_number.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/futex.h"
#include "board/window/mail_words.h"

namespace qduino::board::linux {
namespace {

/// A writer is between its flag and its push for some 30 ns, so a few looks nearly always find it
/// done.
bool seen_quiet(const WriterSlot& slot) {
    for (int look = 0; look < 64; ++look) {
        if (slot.writing.load(std::memory_order_acquire) == 0) return true;
    }
    return false;
}

/// A copy of a request. take_request() is false when it is too long, or when the client wrote
/// a new one during the copy.
struct Request {
    MailHead head;
    std::array<std::uint8_t, kMailBytes> out{};
};
bool take_request(const Mailbox& mail, std::uint32_t sequence, Request& request) {
    std::array<std::uint8_t, sizeof(MailHead)> bytes{};
    load_words(mail.head, bytes);
    std::memcpy(&request.head, bytes.data(), sizeof request.head);
    if (request.head.out_size > kMailBytes || request.head.in_size > kMailBytes) return false;
    load_words(mail.out, {request.out.data(), request.head.out_size});
    return mail.request.load(std::memory_order_relaxed) == sequence;
}

}  // namespace

// ---- sources ------------------------------------------------------------------------------------

const PinEvent* PinsServer::Source::front() {
    return wide ? ring.as<WideRing>()->front() : ring.as<NarrowRing>()->front();
}
void PinsServer::Source::pop() { wide ? ring.as<WideRing>()->pop() : ring.as<NarrowRing>()->pop(); }

Result<PinsServer> PinsServer::create(const std::string& path, bool own_clock) {
    PinsServer server;
    const std::size_t sign = path.rfind('@');
    const auto address = whole_number<std::size_t>(sign == std::string::npos ? "" : path.substr(sign + 1));
    QDUINO_TRY_ASSIGN(server.file_,
                      address ? PinsFile::create_in(path.substr(0, sign), *address) : PinsFile::create(path));
    // From the first poll on: no time of this computer's clock may come in.
    if (own_clock) server.layout().sketch_clock_ns.store(1, std::memory_order_relaxed);
    return server;
}

void PinsServer::find_new_sources(Instant until) {
    for (int writer = 0; writer < kWriterCount; ++writer) {
        const auto index = static_cast<std::size_t>(writer);
        WriterSlot& slot = layout().writers[index];
        if (known_[index] || slot.in_use.load(std::memory_order_acquire) == 0) continue;
        auto ring = file_.map_ring(writer, false);
        // No memory now: the next poll tries again, and nothing is lost meanwhile.
        if (!ring) continue;
        known_[index] = true;
        // It was not there at the last poll. Since then it may have stamped its first edge and been
        // preempted in the middle of it.
        sources_[source_count_++] =
            Source{std::move(*ring), &slot, is_wide(writer), std::max(horizon_, until - kWriterHold / 2)};
    }
}

/// The process of the sketch seems to live: it may still push what it has begun.
bool PinsServer::sketch_lives() const {
    if (sketch_death() != SketchDeath::none) return false;
    const auto pid = static_cast<pid_t>(layout().sketch_pid.load(std::memory_order_relaxed));
    return pid <= 0 || ::kill(pid, 0) == 0 || errno != ESRCH;
}

/// The instant up to which every edge that will ever be pushed is already in the rings; at most
/// `asked`, which is kSettle ago.
Instant PinsServer::exact_until(Instant asked) {
    Instant until = asked;
    for (std::size_t i = 0; i < source_count_; ++i) {
        Source& source = sources_[i];
        if (seen_quiet(*source.slot)) {
            source.quiet_since = asked;
        } else if (asked - source.quiet_since < kWriterHold && sketch_lives()) {
            until = std::min(until, source.quiet_since);
        }
    }
    return std::max(until, horizon_);
}

// ---- the sketch's clock -------------------------------------------------------------------------

bool PinsServer::has_own_clock() const {
    return layout().sketch_clock_ns.load(std::memory_order_relaxed) != 0;
}

Instant PinsServer::now() const {
    const std::int64_t told = layout().sketch_clock_ns.load(std::memory_order_acquire);
    return told != 0 ? instant_from_ns(told) : monotonic_now();
}

Instant PinsServer::past() const { return has_own_clock() ? now() : now() - kSettle; }

/// Returns when each core's stores of before `until` can be seen. If the sketch has a clock of its
/// own, only one thing is known: `until` is over by now.
void PinsServer::settle(Instant until) const {
    const Instant settled = (has_own_clock() ? monotonic_now() : until) + kSettle;
    while (monotonic_now() < settled) {
    }
}

// ---- delivery -----------------------------------------------------------------------------------

std::size_t PinsServer::poll(Instant until, Peripherals& peripherals) {
    layout().machine_alive_ns.store(to_ns(monotonic_now()), std::memory_order_relaxed);
    doorbell_seen_ = layout().doorbell.load(std::memory_order_acquire);
    Requests asked{};
    // Read after the requests were found: what was written before they were posted is older than
    // this.
    if (find_requests(asked)) until = std::max(until, now());
    settle(until);
    find_new_sources(until);
    until = exact_until(until);
    const std::size_t events = deliver(until, peripherals);
    if (events < kBatch) horizon_ = std::max(horizon_, until);
    publish_inputs(peripherals);
    layout().inputs_as_of_ns.store(to_ns(horizon_), std::memory_order_release);
    return events + serve_mail(asked, peripherals);
}

std::size_t PinsServer::deliver(Instant until, Peripherals& peripherals) {
    std::size_t delivered = 0;
    while (delivered < kBatch) {
        Source* earliest = nullptr;
        std::int64_t time_ns = to_ns(until);
        for (std::size_t i = 0; i < source_count_; ++i) {
            const PinEvent* event = sources_[i].front();
            // Strictly earlier than the best so far. On a tie the first source wins, so the order
            // is always the same.
            if (event && (event->time_ns < time_ns || (!earliest && event->time_ns == time_ns))) {
                earliest = &sources_[i];
                time_ns = event->time_ns;
            }
        }
        if (!earliest) break;
        const PinEvent event = *earliest->front();
        earliest->pop();
        hand_over(event, peripherals);
        ++delivered;
    }
    return delivered;
}

void PinsServer::hand_over(const PinEvent& event, Peripherals& peripherals) {
    if (event.pin >= kPinCount || event.kind < PinEventKind::level || event.kind > PinEventKind::pwm_period) {
        ++faults_.malformed;
        return;
    }
    const Instant time = instant_from_ns(event.time_ns);
    if (time < horizon_) ++faults_.disordered;
    horizon_ = std::max(horizon_, time);
    const PinId pin{event.pin};
    if (event.kind == PinEventKind::pwm) {
        const auto duty = std::bit_cast<float>(event.value);
        peripherals.pwm_written(horizon_, pin, duty >= 0 && duty <= 1 ? static_cast<double>(duty) : 0.0);
    } else if (event.kind == PinEventKind::pwm_period) {
        const Nanoseconds period{event.value};
        peripherals.pwm_period_set(horizon_, pin, is_pwm_period(period) ? period : Nanoseconds{0});
    } else {
        peripherals.pin_written(horizon_, pin, event.level == Level::low ? Level::low : Level::high);
    }
}

void PinsServer::publish_inputs(Peripherals& peripherals) {
    bool changed = false;
    for (std::uint16_t number = 0; number < kPinCount; ++number) {
        const OutputPin& output = layout().outputs[number];
        if (!output.is_set() || output.drives()) continue;
        InputPin& input = layout().inputs[number];
        const auto level = static_cast<std::uint32_t>(peripherals.pin_level(horizon_, PinId{number}));
        if (input.level.load(std::memory_order_relaxed) == level) continue;
        input.level.store(level, std::memory_order_release);
        std::atomic<std::uint32_t>& edges = level ? input.rising : input.falling;
        (level ? input.rising_times : input.falling_times)
            .note(edges.load(std::memory_order_relaxed) + 1, now());
        edges.fetch_add(1, std::memory_order_release);
        changed = true;
    }
    if (!changed) return;
    layout().input_changes.fetch_add(1);
    if (layout().input_waiters.load() != 0) futex_wake_all(layout().input_changes);
}

// ---- bus requests -------------------------------------------------------------------------------

bool PinsServer::find_requests(Requests& asked) {
    bool any = false;
    for (std::size_t i = 0; i < asked.size(); ++i) {
        const Mailbox& mail = layout().mail[i];
        const std::uint32_t sequence = mail.request.load(std::memory_order_acquire);
        if ((sequence & 1u) != 0 || sequence == mail.reply.load(std::memory_order_relaxed)) continue;
        asked[i] = sequence;
        any = true;
    }
    return any;
}

std::size_t PinsServer::serve_mail(const Requests& asked, Peripherals& peripherals) {
    std::size_t served = 0;
    for (std::size_t i = 0; i < asked.size(); ++i) {
        if (asked[i] == 0) continue;
        serve(layout().mail[i], asked[i], peripherals);
        ++served;
    }
    return served;
}

void PinsServer::serve(Mailbox& mail, std::uint32_t sequence, Peripherals& peripherals) {
    Request request;
    // Its sketch gave up; the newer request comes next.
    if (!take_request(mail, sequence, request)) return;
    const MailHead& head = request.head;
    std::array<std::uint8_t, kMailBytes> in{};
    const std::span<const std::uint8_t> out{request.out.data(), head.out_size};
    Result<void> done;
    switch (head.kind) {
        case MailKind::sync:
            break;
        case MailKind::i2c:
            done = peripherals.i2c_transfer(horizon_, I2cBus{head.bus}, I2cAddress{head.address}, out,
                                            {in.data(), head.in_size});
            break;
        case MailKind::spi: {
            std::copy(out.begin(), out.end(), in.begin());
            const SpiSettings settings{head.spi_clock_hz, head.spi_mode, head.spi_lsb_first != 0};
            done = peripherals.spi_transfer(horizon_, SpiBus{head.bus}, settings, {in.data(), head.out_size});
            break;
        }
        case MailKind::analog:
            if (head.pin >= kPinCount) {
                done = make_error(ErrorCode::invalid_argument, "no such analog pin");
            } else {
                mail.analog_bits.store(
                    std::bit_cast<std::uint64_t>(peripherals.analog_level(horizon_, PinId{head.pin})),
                    std::memory_order_relaxed);
            }
            break;
        default:
            done = make_error(ErrorCode::invalid_argument, "unknown kind of bus request");
            break;
    }
    if (done) {
        mail.failed.store(0, std::memory_order_relaxed);
        store_words(mail.in, {in.data(), head.in_size});
    } else {
        const std::string_view text = done.error().message;
        mail.failed.store(1 + static_cast<std::uint32_t>(done.error().code), std::memory_order_relaxed);
        mail.text_size.store(static_cast<std::uint32_t>(text.size()), std::memory_order_relaxed);
        store_words(mail.in, {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    }
    mail.reply.store(sequence, std::memory_order_release);
    futex_wake_all(mail.reply);
}

// ---- waiting, sessions --------------------------------------------------------------------------

void PinsServer::wait(Nanoseconds limit) {
    const Nanoseconds most = has_own_clock() ? std::min(limit, kNoBell) : limit;
    futex_wait_until(layout().doorbell, doorbell_seen_, monotonic_now() + most);
}

PinsFaults PinsServer::faults() const {
    PinsFaults all = faults_;
    for (const auto& slot : layout().writers) all.lost += slot.lost.load(std::memory_order_relaxed);
    return all;
}

std::uint64_t PinsServer::sketch_session() const {
    return layout().sketch_session.load(std::memory_order_acquire);
}

SketchDeath PinsServer::sketch_death() const {
    return static_cast<SketchDeath>(
        std::min<std::uint32_t>(layout().sketch_dead.load(std::memory_order_acquire), 2));
}

}  // namespace qduino::board::linux
