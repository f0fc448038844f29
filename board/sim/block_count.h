// Counts the basic blocks of a sketch that run.
//
// The compiler puts a call of __sanitizer_cov_trace_pc() in front of each block of the sketch and
// of its libraries (-fsanitize-coverage=trace-pc; the other boards' objects have none). So the
// count is the same in every run, whatever else the host does. Code that is not compiled so, this
// project's own and the C library's, is not counted.
//
//   block ─► block ─► block ─► …   kBlocksPerLook of them ─► BlockWatch::look()
//
// Each thread has a count of its own. A thread without a watch counts for nobody.
#pragma once

#include <cstdint>

namespace qduino::board::sim {

inline constexpr std::int32_t kBlocksPerLook = 1 << 16;

/// Told of each kBlocksPerLook blocks, from within the sketch's code, which goes on at the return.
class BlockWatch {
  public:
    /// `place` is in the block that runs.
    virtual void look(const void* place) = 0;

  protected:
    ~BlockWatch() = default;
};

struct BlockCount {
    std::int32_t left = kBlocksPerLook;  ///< blocks until the next look
    BlockWatch* watch = nullptr;
};
extern constinit thread_local BlockCount block_count;

/// A call that takes the host about as long as so many blocks, and no virtual time: a loop of such
/// calls is found to spin as soon as one of blocks.
inline void count_call() { block_count.left -= 256; }

/// This thread's blocks are counted for `watch` while this lives.
class Counting {
  public:
    explicit Counting(BlockWatch& watch) : before_(block_count.watch) { block_count.watch = &watch; }
    ~Counting() { block_count.watch = before_; }
    Counting(const Counting&) = delete;
    Counting& operator=(const Counting&) = delete;

  private:
    BlockWatch* before_;
};

}  // namespace qduino::board::sim
