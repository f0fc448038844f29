#include "qduino/monitor/monitor_tty.h"

#include <poll.h>
#include <signal.h>
#include <sys/inotify.h>

#include <array>
#include <chrono>
#include <cstdio>
#include <utility>

#include "posix/small_file.h"
#include "posix/system_error.h"
#include "qduino/upload/serial_way.h"
#include "serial/serial_port.h"
#include "terminal/program.h"

namespace qduino::apps {
namespace {

namespace fs = std::filesystem;

/// A program that opens or closes the port is noticed so late at most.
constexpr int kLookMs = 100;
using std::chrono::steady_clock;
/// A program opens the port, sets it, and then throws away what was in it.
constexpr std::chrono::milliseconds kUntilSet{300};
/// From one attempt to reach the sketch to the next: ssh takes its time.
constexpr std::chrono::seconds kPerAttempt{1};

class TtyMonitor {
  public:
    TtyMonitor(SerialPort port, posix::UniqueFd openings, fs::path link, std::string host,
               posix::UniqueFd signals)
        : port_(std::move(port)),
          openings_(std::move(openings)),
          link_(std::move(link)),
          host_(std::move(host)),
          signals_(std::move(signals)) {}
    ~TtyMonitor();
    TtyMonitor(const TtyMonitor&) = delete;
    TtyMonitor& operator=(const TtyMonitor&) = delete;

    void run();

  private:
    [[nodiscard]] bool is_open() const { return way_.socket.valid(); }
    void follow_program();
    void begin_again();
    void leave();
    void take_serial();
    void take_typed();

    SerialPort port_;
    posix::UniqueFd openings_;  // inotify(7)
    fs::path link_;
    std::string host_;
    posix::UniqueFd signals_;
    SerialWay way_;
    bool program_is_there_ = false;
    steady_clock::time_point attempt_at_;
    std::string shown_;  // of the sketch's bytes, those that the port had no room for
};

TtyMonitor::~TtyMonitor() {
    leave();
    std::error_code ignored;
    if (fs::read_symlink(link_, ignored) == port_.name()) fs::remove(link_, ignored);
}

void TtyMonitor::leave() {
    shown_.clear();
    if (is_open()) close_way(way_);
}

void TtyMonitor::follow_program() {
    program_is_there_ = port_.host_is_there();
    if (!program_is_there_) return leave();
    if (is_open() || steady_clock::now() < attempt_at_) return;
    attempt_at_ = steady_clock::now() + kPerAttempt;
    if (auto opened = open_way(host_)) way_ = std::move(*opened);
}

/// A program has opened the port. Another one may have closed it just before, too shortly to be
/// seen: this one is shown the sketch from its beginning all the same.
void TtyMonitor::begin_again() {
    std::array<char, 4096> events;
    static_cast<void>(posix::read_some(openings_.get(), events, "the port's openings"));
    leave();
    attempt_at_ = steady_clock::now() + kUntilSet;
}

void TtyMonitor::take_serial() {
    std::array<char, 4096> bytes;
    const auto count = posix::read_some(way_.socket.get(), bytes, "Serial");
    if (!count || *count == 0) return leave();  // the sketch has ended; another one may come
    shown_.assign(bytes.data(), *count);
    shown_.erase(0, port_.write(shown_));
}

void TtyMonitor::take_typed() {
    std::array<char, 4096> bytes;
    const auto count = port_.read(bytes);
    if (!count || *count == 0 || !is_open()) return;
    if (!posix::write_all(way_.socket.get(), std::string_view{bytes.data(), *count}, "Serial")) leave();
}

void TtyMonitor::run() {
    ::signal(SIGPIPE, SIG_IGN);
    for (;;) {
        follow_program();
        // Without a program the port reports its absence at once, again and again: it is not
        // waited for.
        const int port = program_is_there_ ? port_.fd() : -1;
        const bool full = !shown_.empty();
        std::array looks{pollfd{signals_.get(), POLLIN, 0},
                         pollfd{is_open() && !full ? way_.socket.get() : -1, POLLIN, 0},
                         pollfd{port, static_cast<short>(full ? POLLIN | POLLOUT : POLLIN), 0},
                         pollfd{openings_.get(), POLLIN, 0}};
        if (::poll(looks.data(), looks.size(), kLookMs) < 0) continue;
        if (looks[0].revents != 0) return;
        if (looks[3].revents != 0) {
            begin_again();
            continue;
        }
        if (looks[1].revents != 0) take_serial();
        if ((looks[2].revents & POLLOUT) != 0) shown_.erase(0, port_.write(shown_));
        if ((looks[2].revents & POLLIN) != 0) take_typed();
    }
}

}  // namespace

Result<int> monitor_tty(const fs::path& link, const std::string& host) {
    std::error_code failed;
    if (const auto there = fs::symlink_status(link, failed); fs::exists(there) && !fs::is_symlink(there))
        return make_error(ErrorCode::already_exists, link.native(),
                          " is there, and is no link: not replaced");
    // Before there is a link that a signal would leave behind.
    posix::UniqueFd signals{block_and_watch({SIGINT, SIGTERM, SIGHUP})};
    QDUINO_TRY_ASSIGN(SerialPort port, SerialPort::make_pty(link));
    posix::UniqueFd openings{::inotify_init1(IN_CLOEXEC)};
    if (!openings.valid() || ::inotify_add_watch(openings.get(), port.name().c_str(), IN_OPEN) < 0)
        return posix::system_error("watch", port.name());
    std::printf("Serial is %s, that is %s. Ctrl-C ends it.\n", link.c_str(), port.name().c_str());
    std::fflush(stdout);
    TtyMonitor(std::move(port), std::move(openings), link, host, std::move(signals)).run();
    return 0;
}

}  // namespace qduino::apps
