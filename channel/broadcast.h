// One writer, a fixed number of readers: a fact that several threads or processes need is written
// once.
//
// A four-slot has one reader, because that reader says in it where it reads. Readers that shared
// one would send the writer into the pair that another of them is in. So each has a four-slot of
// its own, and a write goes through all of them:
//
//   write(v) ──┬──► four-slot ──► reader 0
//              ├──► four-slot ──► reader 1
//              └──► four-slot ──► reader 2      (may lie in shared memory)
//
// Invariants: no side ever waits. Each reader sees whole values, in the order in which they were
// written. Two readers may see different values at the same instant.
#pragma once

#include <array>
#include <cstddef>

#include "channel/four_slot.h"

namespace qduino::channel {

/// The writing side. The four-slots outlive it, and nothing else writes to them.
template <typename T, std::size_t Readers>
class Broadcast {
  public:
    explicit Broadcast(const std::array<FourSlot<T>*, Readers>& readers) : readers_(readers) {}

    /// Writer only. Wait-free: one copy of T for each reader.
    void write(const T& value) {
        for (FourSlot<T>* reader : readers_) reader->write(value);
    }

  private:
    std::array<FourSlot<T>*, Readers> readers_;
};

}  // namespace qduino::channel
