// Encoder: counts the edges of a quadrature encoder, under the library's name. The library itself
// reads the pins' registers, and stops the compiler on a board whose interrupts it does not list.
//
//   pin 2    ▁▁▔▔▔▔▁▁▁▁▔▔▔▔▁▁      on the way up pin 2 comes first
//   pin 1    ▁▁▁▁▔▔▔▔▁▁▁▁▔▔▔▔
//   position 0 1 2 3 4 5 6 7
//
// A handler of attachInterrupt() looks at both pins at each of their edges, and read() looks once
// more. What a look finds is added to the position in one step that cannot be cut in two, so
// neither has to hold the other back. Where two edges came between two looks, they count as they do
// for the library where pin 1 alone has an interrupt.
//
// Source: the library's page (pjrc.com/teensy/td_libs_Encoder.html), and the table of steps in its
// header, version 1.2.
#pragma once

#include <atomic>
#include <cstdint>

#include "arduino/Arduino.h"

#if defined(ENCODER_DO_NOT_USE_INTERRUPTS) && !defined(ENCODER_USE_INTERRUPTS)
#define QDUINO_ENCODER_BY_INTERRUPTS false
#else
#define QDUINO_ENCODER_BY_INTERRUPTS true
#endif

class Encoder {
  public:
    /// A global object, or in setup(): a handler keeps its address for good. Both pins get a
    /// pull-up. The position is 0 where the encoder stands when setup() begins. Without interrupts
    /// (ENCODER_DO_NOT_USE_INTERRUPTS), and beyond 32 encoders, it is followed by read() alone.
    Encoder(int pin1, int pin2, bool by_interrupts = QDUINO_ENCODER_BY_INTERRUPTS);
    Encoder(const Encoder&) = delete;
    Encoder& operator=(const Encoder&) = delete;

    /// In edges: four for each period of a line. Wraps behind 32 bits.
    std::int32_t read();
    std::int32_t readAndReset();
    void write(std::int32_t position) { exchange(position); }

  private:
    /// What has been seen so far.
    struct Seen {
        std::uint32_t position;
        std::int32_t phase;  ///< 0 to 3 on the way up; −1: nobody has looked yet
    };
    static_assert(std::atomic<Seen>::is_always_lock_free);

    Seen look();
    std::int32_t exchange(std::int32_t position);
    static void look_at_all();
    template <int Index>
    static void edge();

    int pin1_, pin2_;
    std::atomic<Seen> seen_{Seen{0, -1}};
};
