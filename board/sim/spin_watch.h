// Lets a spin take virtual time: code that runs on, and asks the board for nothing.
//
// Code takes no virtual time by itself. So `while (!flag);` would stand at one instant for ever:
// no interrupt would come that sets the flag, no budget would end, and no run. The blocks of the
// sketch that run are counted (block_count.h). More than SimConfig::spin_limit of them at one
// instant are taken for a spin, and from there on it takes time:
//
//   blocks   0 ............ spin_limit | look | look | look …
//   time     free: at one instant      | 65 µs each, then 1/16 of what the spin has taken so far
//
// The growing steps bring a spin of days to its end in some hundred looks. They make nothing late:
// when other code has run, the spinning code goes on at that very instant and sees what changed.
// Only what two spins say to each other may be seen kBetweenSpins late.
//
// A place that spun once is known: there the next stretch is taken for a spin at its first look.
//
// A jump to itself runs no counted block: GCC counts no empty one. `while (true);` is none, for
// tools/ino/as_arduino.py puts a statement into it. A signal finds what is left (endless_jump.h);
// it stands at one instant and changes nothing, so the run stays the same.
#pragma once

#include <vector>

#include "board/sim/block_count.h"
#include "board/sim/config.h"
#include "board/sim/spin.h"

namespace qduino::board::sim {

class EventLoop;

class SpinWatch final : public BlockWatch {
  public:
    /// `loop` and `config` outlive it.
    SpinWatch(EventLoop& loop, const SimConfig& config) : loop_(loop), config_(config) {}

    void look(const void* place) override;
    /// The running code jumps to itself at `place`: takes all time that is to come. Does not return
    /// while the run goes on, and never to code that does anything.
    void never_go_on(const void* place);

    /// The last spin of setup(), and of each VCPU.
    [[nodiscard]] std::vector<SpinSeen> seen() const;

    /// Where the running code's spin is kept.
    [[nodiscard]] Spin& spin_of_caller();

  private:
    [[nodiscard]] bool is_known(const Spin& spin, const void* place) const;
    void charge(Spin& spin, const void* place);

    EventLoop& loop_;
    const SimConfig& config_;
    Spin setup_;
};

}  // namespace qduino::board::sim
