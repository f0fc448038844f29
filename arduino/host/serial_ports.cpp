#include "arduino/host/serial_ports.h"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

#include "posix/system_error.h"

namespace qduino::arduino::host {

namespace {

constexpr int kCarrierPollMs = 50;
// In the host's time: waiting for a terminal costs no virtual time in the simulator.
constexpr timespec kNap{0, 200'000};

}  // namespace

// ---- DescriptorPort -----------------------------------------------------------------------------

DescriptorPort::~DescriptorPort() { DescriptorPort::close(); }

Result<void> DescriptorPort::start(int read_descriptor, int write_descriptor) {
    read_descriptor_ = read_descriptor;
    write_descriptor_ = write_descriptor;
    input_begin_ = input_end_ = 0;
    stopping_ = false;
    carried_ = ring_->pushed();
    if (sem_init(&wake_, 0, 0) != 0) return posix::system_error("carry", "a serial port");
    try {
        carrier_ = std::thread([this] { carry(); });
    } catch (const std::system_error&) {
        return make_error(
            ErrorCode::unavailable,
            "no thread to carry a serial port: call Serial.begin() in setup(), as a loop with a "
            "budget may make none");
    }
    return {};
}

void DescriptorPort::close() {
    if (!carrier_.joinable()) return;
    stopping_ = true;
    sem_post(&wake_);
    carrier_.join();
    sem_destroy(&wake_);
}

void DescriptorPort::fill() {
    if (input_begin_ != input_end_ || read_descriptor_ < 0) return;
    pollfd look{read_descriptor_, POLLIN, 0};
    if (poll(&look, 1, 0) <= 0 || !(look.revents & (POLLIN | POLLHUP))) return;
    const ssize_t count = ::read(read_descriptor_, input_.data(), input_.size());
    input_begin_ = 0;
    input_end_ = count > 0 ? static_cast<std::size_t>(count) : 0;
    if (count == 0) read_descriptor_ = -1;  // the end of a file or pipe: nothing more will come
}

std::size_t DescriptorPort::available() {
    fill();
    return input_end_ - input_begin_;
}
int DescriptorPort::peek() {
    fill();
    return input_begin_ == input_end_ ? -1 : input_[input_begin_];
}
int DescriptorPort::read() {
    const int value = peek();
    if (value >= 0) ++input_begin_;
    return value;
}

std::size_t DescriptorPort::write(std::span<const std::uint8_t> bytes) {
    std::size_t taken = 0;
    while (taken < bytes.size()) {
        const std::size_t count = ring_->push_some(bytes.subspan(taken));
        taken += count;
        if (count > 0) sem_post(&wake_);
        if (taken == bytes.size() || when_full_ == WhenFull::drop) break;
        if (count == 0) nanosleep(&kNap, nullptr);
    }
    return taken;
}

void DescriptorPort::flush() {
    const std::uint64_t until = ring_->pushed();
    while (carrier_.joinable() && carried_.load(std::memory_order_acquire) < until) nanosleep(&kNap, nullptr);
}

void DescriptorPort::flush_for(int ms) {
    const std::uint64_t until = ring_->pushed();
    for (int naps = ms * 5; naps > 0 && carrier_.joinable(); --naps) {
        if (carried_.load(std::memory_order_acquire) >= until) return;
        nanosleep(&kNap, nullptr);
    }
}

void DescriptorPort::hold_output(bool held) {
    held_ = held;
    if (carrier_.joinable()) sem_post(&wake_);
}

const char* DescriptorPort::lost() const {
    const int error = lost_by_;
    return error == 0 ? nullptr : ::strerrordesc_np(error);
}

void DescriptorPort::carry() {
    // All signals are the sketch's. A broken pipe comes back as an error of write(2).
    sigset_t signals;
    sigfillset(&signals);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
    std::array<std::uint8_t, 4096> chunk;
    bool connected = true;
    while (true) {
        while (!held_.load() || stopping_.load()) {
            const std::size_t count = ring_->pop_some(chunk);
            if (count == 0) break;
            connected = connected && carry_bytes({chunk.data(), count});
            carried_.fetch_add(count, std::memory_order_release);
        }
        if (stopping_.load()) return;
        while (sem_wait(&wake_) != 0 && errno == EINTR) {
        }
    }
}

bool DescriptorPort::carry_bytes(std::span<const std::uint8_t> bytes) {
    while (!bytes.empty()) {
        pollfd look{write_descriptor_, POLLOUT, 0};
        if (poll(&look, 1, kCarrierPollMs) == 0) {
            // The other side does not read: the end of the program must not wait for it.
            if (stopping_.load()) return true;
            if (when_full_ == WhenFull::drop) return true;
            continue;
        }
        const ssize_t count = ::write(write_descriptor_, bytes.data(), bytes.size());
        if (count < 0 && errno != EINTR && errno != EAGAIN) {
            if (errno != EPIPE) lost_by_ = errno;
            return false;
        }
        if (count > 0) bytes = bytes.subspan(static_cast<std::size_t>(count));
    }
    return true;
}

// ---- ConsolePort --------------------------------------------------------------------------------

Result<void> ConsolePort::open(unsigned long, std::uint16_t) { return start(STDIN_FILENO, STDOUT_FILENO); }

// ---- TerminalPort -------------------------------------------------------------------------------

namespace {

constexpr std::pair<unsigned long, speed_t> kSpeeds[] = {
    {300, B300},       {600, B600},       {1200, B1200},       {2400, B2400},
    {4800, B4800},     {9600, B9600},     {19200, B19200},     {38400, B38400},
    {57600, B57600},   {115200, B115200}, {230400, B230400},   {460800, B460800},
    {500000, B500000}, {921600, B921600}, {1000000, B1000000}, {2000000, B2000000}};

/// `config` as in HardwareSerial.h.
void apply_frame(termios& settings, std::uint16_t config) {
    constexpr tcflag_t kSizes[] = {CS5, CS6, CS7, CS8};
    const unsigned data_bits = (config >> 8) & 0xf;
    const unsigned parity = (config >> 4) & 0x3;
    settings.c_cflag &= ~static_cast<tcflag_t>(CSIZE | PARENB | PARODD | CSTOPB);
    settings.c_cflag |= kSizes[data_bits >= 5 && data_bits <= 8 ? data_bits - 5 : 3];
    if (parity != 0) settings.c_cflag |= PARENB;
    if (parity == 2) settings.c_cflag |= PARODD;
    if ((config & 0x3) == 2) settings.c_cflag |= CSTOPB;
}

Result<void> configure(int descriptor, const std::string& path, unsigned long baud, std::uint16_t config) {
    termios settings{};
    if (tcgetattr(descriptor, &settings) != 0) return posix::system_error("look at", path);
    cfmakeraw(&settings);
    apply_frame(settings, config);
    settings.c_cflag |= CLOCAL | CREAD;
    const auto* const known = std::ranges::find(kSpeeds, baud, &std::pair<unsigned long, speed_t>::first);
    if (known == std::end(kSpeeds))
        return make_error(ErrorCode::invalid_argument, path, ": no such speed, ", baud);
    cfsetspeed(&settings, known->second);
    if (tcsetattr(descriptor, TCSANOW, &settings) != 0) return posix::system_error("set up", path);
    return {};
}

}  // namespace

Result<void> TerminalPort::open(unsigned long baud, std::uint16_t config) {
    descriptor_.reset(::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
    if (!descriptor_.valid()) return posix::system_error("open", path_);
    if (const auto configured = configure(descriptor_.get(), path_, baud, config); !configured) {
        close();
        return configured.error();
    }
    return start(descriptor_.get(), descriptor_.get());
}

void TerminalPort::close() {
    DescriptorPort::close();
    descriptor_.reset();
}

// ---- PseudoTerminalPort -------------------------------------------------------------------------

Result<void> PseudoTerminalPort::open(unsigned long, std::uint16_t config) {
    master_.reset(posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC | O_NONBLOCK));
    const int master = master_.get();
    char name[64];
    if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0 ||
        ptsname_r(master, name, sizeof name) != 0) {
        return posix::system_error("make", "a pseudo-terminal");
    }
    name_ = name;
    slave_.reset(::open(name, O_RDWR | O_NOCTTY | O_CLOEXEC));
    if (!slave_.valid()) return posix::system_error("open", name_);
    QDUINO_TRY(configure(slave_.get(), name_, 115200, config));
    if (!link_.empty()) {
        unlink(link_.c_str());
        if (symlink(name, link_.c_str()) != 0) return posix::system_error("link", link_);
    }
    return start(master, master);
}

void PseudoTerminalPort::close() {
    DescriptorPort::close();
    if (master_.valid() && !link_.empty()) unlink(link_.c_str());
    master_.reset();
    slave_.reset();
    name_.clear();
}

// ---- choosing a port ----------------------------------------------------------------------------

namespace {

/// Prints the name of the other end as soon as it exists.
class AnnouncedPseudoTerminal final : public PseudoTerminalPort {
  public:
    AnnouncedPseudoTerminal(int number, std::string link)
        : PseudoTerminalPort(std::move(link)), number_(number) {}
    Result<void> open(unsigned long baud, std::uint16_t config) override {
        QDUINO_TRY(PseudoTerminalPort::open(baud, config));
        std::fprintf(stderr, "Serial%d is %s\n", number_, name().c_str());
        return {};
    }

  private:
    int number_;
};

}  // namespace
}  // namespace qduino::arduino::host

/// The others than the console follow QDUINO_SERIAL<number>.
std::unique_ptr<qduino::arduino::SerialPort> qduino::arduino::default_serial_port(int number) {
    if (number == 0) return std::make_unique<host::ConsolePort>();
    const std::string variable = "QDUINO_SERIAL" + std::to_string(number);
    const char* setting = std::getenv(variable.c_str());
    const std::string where = setting ? setting : "pty";
    if (where == "pty") return std::make_unique<host::AnnouncedPseudoTerminal>(number, "");
    if (where.starts_with("pty:"))
        return std::make_unique<host::AnnouncedPseudoTerminal>(number, where.substr(4));
    return std::make_unique<host::TerminalPort>(where);
}
