#include "apps/printd/serial_host.h"

#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <utility>

#include "posix/system_error.h"
#include "printer/gcode/reports.h"

namespace qduino::printd {

using printer::gcode::EmergencyCodes;

namespace {

/// How long the thread of the port waits for a byte, for an answer, or for a host that opens a pty.
constexpr int kLookEvery_ms = 50;
/// What is read in one turn: then the host is answered, however fast it sends.
constexpr int kReadsAtOnce = 16;
/// Answers that wait for a host that does not read. Beyond them its session says no more.
constexpr std::size_t kAnswersMax = 64 * 1024;

Instant clock_now() {
    using namespace std::chrono;
    return instant_from_ns(duration_cast<nanoseconds>(steady_clock::now().time_since_epoch()).count());
}

}  // namespace

SerialHost::SerialHost(apps::SerialPort port, posix::UniqueFd wake, spool::Spool& spool,
                       web::Executor on_spool, bool has_bed)
    : port_(std::move(port)),
      wake_(std::move(wake)),
      spool_(spool),
      on_spool_(std::move(on_spool)),
      has_bed_(has_bed) {}

Result<std::unique_ptr<SerialHost>> SerialHost::start(apps::SerialPort port, spool::Spool& spool,
                                                      web::Executor on_spool, bool has_bed) {
    posix::UniqueFd wake{::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)};
    if (!wake.valid()) return posix::system_error("make", "an event of the serial port");
    std::unique_ptr<SerialHost> made{
        new SerialHost{std::move(port), std::move(wake), spool, std::move(on_spool), has_bed}};
    made->thread_ = std::thread{[host = made.get()] { host->serve(); }};
    return made;
}

SerialHost::~SerialHost() { stop(); }

void SerialHost::stop() {
    stop_.store(true);
    wake();
    if (thread_.joinable()) thread_.join();
}

void SerialHost::wake() const { static_cast<void>(::eventfd_write(wake_.get(), 1)); }

// ---- the thread of the port ---------------------------------------------------------------------

void SerialHost::serve() {
    while (!stop_.load()) {
        wait_for_work();
        const Instant now = clock_now();
        watch_presence(now);
        if (there_) read_port(now);
        {
            const std::scoped_lock lock{mutex_};
            session_.tick(now);
            if (unsent_.size() < kAnswersMax) unsent_ += session_.take_output();
        }
        write_port();
    }
}

void SerialHost::wait_for_work() {
    std::array<pollfd, 2> ways{{{wake_.get(), POLLIN, 0}, {port_.fd(), POLLIN, 0}}};
    if (!unsent_.empty()) ways[1].events |= POLLOUT;
    // A pty without a host would never let poll() wait.
    ::poll(ways.data(), there_ ? ways.size() : 1, kLookEvery_ms);
    eventfd_t ignored = 0;
    static_cast<void>(::eventfd_read(wake_.get(), &ignored));
}

void SerialHost::watch_presence(Instant now) {
    const bool was_there = std::exchange(there_, port_.host_is_there());
    bool silent = false;
    {
        const std::scoped_lock lock{mutex_};
        silent = there_ && !port_.sees_host() && session_.under_way() == 0 && now - heard_ >= kSilentAfter;
        if (was_there && !there_) session_.close();
    }
    if (silent || (was_there && !there_)) on_spool_([this] { spool_.host_leaves(); });
    if (silent || (!was_there && there_)) greet(now);
}

void SerialHost::greet(Instant now) {
    scanner_ = {};
    unsent_.clear();
    heard_ = now;
    const std::scoped_lock lock{mutex_};
    session_.open();
}

void SerialHost::read_port(Instant now) {
    std::array<char, 4096> bytes;
    std::unique_lock lock{mutex_};
    for (int reads = 0; reads < kReadsAtOnce; ++reads) {
        const Result<std::size_t> count = port_.read(bytes);
        if (!count.ok() || *count == 0) break;
        heard_ = now;
        const std::span<const char> came = std::span{bytes}.first(*count);
        act_on(scanner_.feed(came));
        session_.take(came, now);
    }
    const bool lines = session_.has_lines();
    lock.unlock();
    if (lines && !sending_.exchange(true)) on_spool_([this] { send_lines(); });
}

/// Holds the session's lock. (An M112 has been acted on: apps/port.)
void SerialHost::act_on(const EmergencyCodes& codes) {
    if (codes.break_wait) session_.send_at_once("M108");
    if (codes.stop_moves) session_.send_at_once("M410");
}

void SerialHost::write_port() {
    if (!there_) return unsent_.clear();
    if (!unsent_.empty()) unsent_.erase(0, port_.write(unsent_));
}

// ---- the spool's thread -------------------------------------------------------------------------

void SerialHost::send_lines() {
    sending_.store(false);
    std::vector<apps::HostLine> lines;
    {
        const std::scoped_lock lock{mutex_};
        lines = session_.take_lines();
    }
    for (const apps::HostLine& line : lines) {
        const auto claim = line.claims ? spool::HostClaim::printer : spool::HostClaim::none;
        const Result<void> sent = spool_.host_line(line.text, claim);
        if (sent.ok()) continue;
        const std::scoped_lock lock{mutex_};
        session_.refuse(sent.error());
    }
}

apps::PrinterNews SerialHost::news() const {
    const spool::MachineView& machine = spool_.machine();
    if (!machine.connected || machine.life != spool::SketchLife::alive) return {};
    const auto reading = [](const printer::link::HeaterStatus& heater) {
        return printer::gcode::HeaterReading{Celsius{heater.celsius}, Celsius{heater.target_celsius},
                                             heater.duty};
    };
    const auto bed = has_bed_ ? std::optional{reading(machine.heat.bed)} : std::nullopt;
    const bool faulted = machine.job.state == printer::link::MachineState::faulted;
    return {.connected = true,
            .session = machine.session,
            .lines_over = machine.job.host_lines,
            .temperatures =
                std::string{printer::gcode::format_temperatures(reading(machine.heat.hot_end), bed).view()},
            .fault = faulted ? std::string{machine.job.fault.view()} : std::string{}};
}

void SerialHost::tick(Instant now) {
    const apps::PrinterNews newest = news();
    {
        const std::scoped_lock lock{mutex_};
        for (const spool::Reply& reply : spool_.take_host_replies()) session_.hear(reply.kind, reply.text);
        session_.learn(newest, now);
    }
    send_lines();
    wake();
}

}  // namespace qduino::printd
