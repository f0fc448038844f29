#include "apps/port/port_relay.h"

#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "board/linux/kernel/clock.h"

namespace qduino::port {

using board::linux::monotonic_now;

namespace {

/// For a host that opens a pty, a service that comes up, a sketch that starts anew.
constexpr Nanoseconds kLookEvery = 50ms;
/// More than the kernel keeps of a terminal's bytes (64 KiB; its drivers/tty/tty_buffer.c).
constexpr int kLastReads = 2 * 65'536 / PortRelay::kAtOnce;

bool would_block() { return errno == EAGAIN || errno == EINTR; }

}  // namespace

PortRelay::PortRelay(apps::SerialPort port, std::string service, std::filesystem::path link)
    : port_(std::move(port)), service_path_(std::move(service)), link_path_(std::move(link)) {
    to_host_.reserve(kAnswersMax + kAtOnce);
}

void PortRelay::turn() {
    wait();
    vcpu_.begin();
    if (monotonic_now() >= look_at_) look_around();
    if (there_) take_from_host();
    if (service_.valid()) give_to_service();
    if (service_.valid()) take_from_service();
    if (there_ && !to_host_.empty()) give_to_host();
    vcpu_.end();
}

void PortRelay::wait() {
    // A descriptor of −1 is left out (poll(2)). A pty without a host would never let it wait.
    std::array<pollfd, 2> ways{
        {{there_ ? port_.fd() : -1, POLLIN, 0}, {service_.valid() ? service_.get() : -1, 0, 0}}};
    if (!to_host_.empty()) ways[0].events |= POLLOUT;
    if (to_host_.size() < kAnswersMax) ways[1].events |= POLLIN;
    if (!to_service_.empty()) ways[1].events |= POLLOUT;
    const Nanoseconds left = std::max(look_at_ - monotonic_now(), Nanoseconds{0});
    const timespec at_most = board::linux::to_timespec(to_ns(left));
    ::ppoll(ways.data(), ways.size(), &at_most, nullptr);
    if (((ways[0].revents | ways[1].revents) & (POLLHUP | POLLERR)) != 0) look_at_ = kEpoch;
}

void PortRelay::look_around() {
    look_at_ = monotonic_now() + kLookEvery;
    find_link();
    vcpu_.follow(link_ ? &link_.get()->port_vcpu : nullptr);
    const bool was_there = std::exchange(there_, port_.host_is_there());
    if (!there_) return hear_out();
    if (!was_there) begin_anew();
    if (!service_.valid()) connect();
}

/// A host has gone, or has come and gone since the last look: what it said last is still in the
/// port, an M112 maybe (`echo M112 > STATE/serial`). It goes to the service before the end.
void PortRelay::hear_out() {
    for (int reads = 0; reads < kLastReads && take_from_host(); ++reads) {
        if (service_.valid()) give_to_service();
    }
    to_service_.begin();
    service_.reset();
    begin_anew();
}

void PortRelay::begin_anew() {
    scanner_ = {};
    to_host_.clear();
}

void PortRelay::find_link() {
    if (link_.is_current(link_path_)) return;
    if (auto mapped = apps::map_link(link_path_)) link_ = std::move(*mapped);
}

void PortRelay::connect() {
    to_service_.drop();
    if (auto connected = apps::connect_relay(service_path_)) service_ = std::move(*connected);
}

bool PortRelay::take_from_host() {
    std::array<char, kAtOnce> bytes;
    const Result<std::size_t> count = port_.read(bytes);
    if (!count.ok() || *count == 0) return false;
    const std::span<const char> came = std::span{bytes}.first(*count);
    if (scanner_.feed(came).stop) stop_printer();
    to_service_.append(came);
    if (!service_.valid()) to_service_.drop();
    return true;
}

/// The sketch may have been started anew since the last look.
void PortRelay::stop_printer() {
    const std::int64_t now_ns = to_ns(monotonic_now());
    find_link();
    if (!link_) return;
    link_.get()->emergency.fetch_add(1, std::memory_order_release);
    link_.get()->port_stop_ns.store(now_ns, std::memory_order_relaxed);
}

void PortRelay::give_to_service() {
    if (to_service_.empty()) return;
    const ssize_t count = ::send(service_.get(), to_service_.bytes().data(),
                                 std::min(to_service_.size(), kAtOnce), MSG_NOSIGNAL);
    if (count > 0) to_service_.take(static_cast<std::size_t>(count));
    if (count < 0 && !would_block()) service_.reset();
}

void PortRelay::take_from_service() {
    if (to_host_.size() >= kAnswersMax) return;
    std::array<char, kAtOnce> bytes;
    const ssize_t count = ::recv(service_.get(), bytes.data(), bytes.size(), 0);
    if (count > 0) to_host_.append(bytes.data(), static_cast<std::size_t>(count));
    if (count == 0 || (count < 0 && !would_block())) service_.reset();
}

void PortRelay::give_to_host() {
    to_host_.erase(0, port_.write(std::string_view{to_host_}.substr(0, kAtOnce)));
}

}  // namespace qduino::port
