// A file that a thread of its own reads ahead.
//
// The machine's loop must answer its pins and buses within milliseconds, and a disk under load may
// take a second. So read() takes bytes from a ring, and waits only when the ring has run dry:
//
//   file ──read──► [reader thread] ──ring of 4 MiB──► read()
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
    /// Opens the file and starts to read. A file that cannot be read is empty: ask ok() first.
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
