// A file read ahead by a thread of its own, so that whoever takes its bytes does not wait for the disk.
//
//   file ──read──► [reader thread] ──ring of 4 MiB──► read()
//
// The machine's loop must answer its pins and buses within milliseconds; a disk under load may take a second. Only when
// the ring has run dry does read() wait.
#pragma once

#include <atomic>
#include <cstddef>
#include <fstream>
#include <memory>
#include <span>
#include <string>
#include <thread>

#include "channel/ring_buffer.h"
#include "twin/byte_source.h"

namespace qduino::apps {

class PrefetchSource final : public twin::ByteSource {
  public:
    /// Opens the file and starts to read. An unreadable one is empty: ask ok() first.
    explicit PrefetchSource(const std::string& path);
    ~PrefetchSource() override;
    PrefetchSource(const PrefetchSource&) = delete;
    PrefetchSource& operator=(const PrefetchSource&) = delete;

    [[nodiscard]] bool ok() const { return ok_; }
    std::size_t read(std::span<char> into) override;

  private:
    using Ring = channel::RingBuffer<char, std::size_t{1} << 22>;
    void read_ahead();

    std::ifstream file_;
    bool ok_;
    std::unique_ptr<Ring> ring_;
    std::atomic<bool> ended_{false};
    std::atomic<bool> stop_{false};
    std::thread reader_;
};

}  // namespace qduino::apps
