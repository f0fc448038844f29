// Serial ports of a Linux host: standard input and output, real ports, pseudo-terminals.
//
//   loop ──write──► ring (64 KB) ──► carrier thread ──write(2)──► terminal, pipe, /dev/ttyUSB0 …
//   loop ◄──read─── poll(2) without waiting + read(2)
//
// To write, a loop makes no system call except the post that wakes the carrier. To read, it looks
// at the descriptor itself: it sees the input in the order of its looks, and a simulated run fed
// from a file is the same every time.
#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "arduino/core/serial_port.h"
#include "channel/ring_buffer.h"
#include "posix/unique_fd.h"

namespace qduino::arduino::host {

/// What a writer does when the ring is full.
enum class WhenFull : std::uint8_t {
    wait,  ///< until the carrier made room: nothing is lost
    drop,  ///< as a wire does to which nobody listens
};

/// A port over file descriptors. Derived classes open them.
class DescriptorPort : public SerialPort {
  public:
    explicit DescriptorPort(WhenFull when_full) : when_full_(when_full) {}
    ~DescriptorPort() override;
    DescriptorPort(const DescriptorPort&) = delete;
    DescriptorPort& operator=(const DescriptorPort&) = delete;

    /// Carries out what is left (where somebody listens) and stops the carrier.
    void close() override;
    std::size_t available() override;
    int read() override;
    int peek() override;
    std::size_t write(std::span<const std::uint8_t> bytes) override;
    std::size_t room() override { return ring_->free(); }
    void flush() override;
    void flush_for(int ms) override;
    void hold_output(bool held) override;
    [[nodiscard]] const char* lost() const override;

  protected:
    using Ring = channel::RingBuffer<std::uint8_t, 65536>;

    /// Starts to carry between these; they stay the derived class's to close, after close().
    Result<void> start(int read_descriptor, int write_descriptor);
    [[nodiscard]] bool is_started() const { return carrier_.joinable(); }

  private:
    void fill();
    void carry();
    /// False when the other end is gone; bytes written after that are dropped.
    bool carry_bytes(std::span<const std::uint8_t> bytes);

    WhenFull when_full_;
    int read_descriptor_ = -1;
    int write_descriptor_ = -1;
    std::array<std::uint8_t, 512> input_{};
    std::size_t input_begin_ = 0;
    std::size_t input_end_ = 0;
    std::unique_ptr<Ring> ring_ = std::make_unique<Ring>();
    std::atomic<std::uint64_t> carried_{0};
    std::atomic<int> lost_by_{0};  // the system's error
    std::atomic<bool> stopping_{false};
    std::atomic<bool> held_{false};
    sem_t wake_{};
    std::thread carrier_;
};

/// Standard input and output of the program.
class ConsolePort final : public DescriptorPort {
  public:
    ConsolePort() : DescriptorPort(WhenFull::wait) {}
    ~ConsolePort() override { close(); }
    Result<void> open(unsigned long baud, std::uint16_t config) override;
};

/// A real port, or anything that is a terminal device.
class TerminalPort final : public DescriptorPort {
  public:
    explicit TerminalPort(std::string path) : DescriptorPort(WhenFull::wait), path_(std::move(path)) {}
    ~TerminalPort() override { close(); }
    /// Error: not_found / not_permitted, by path; invalid_argument for a speed that the driver does
    /// not have.
    Result<void> open(unsigned long baud, std::uint16_t config) override;
    void close() override;

  private:
    std::string path_;
    posix::UniqueFd descriptor_;
};

/// A new pseudo-terminal, for another program to open as if it were a serial port.
class PseudoTerminalPort : public DescriptorPort {
  public:
    /// `link` (may be empty) becomes a symbolic link to it.
    explicit PseudoTerminalPort(std::string link) : DescriptorPort(WhenFull::drop), link_(std::move(link)) {}
    ~PseudoTerminalPort() override { PseudoTerminalPort::close(); }
    Result<void> open(unsigned long baud, std::uint16_t config) override;
    void close() override;
    /// "/dev/pts/5"; empty before open().
    [[nodiscard]] const std::string& name() const { return name_; }

  private:
    std::string link_;
    std::string name_;
    posix::UniqueFd master_;
    // Held open, so that the master does not see a hang-up between two listeners.
    posix::UniqueFd slave_;
};

}  // namespace qduino::arduino::host
