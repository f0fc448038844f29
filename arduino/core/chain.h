// A chain: which loops lead from an input to an output, and how long that may take, end to end.
//
//   RingBuffer<Sample, 8> samples;
//   Chain stop{"stop button to heater"};
//
//   void setup() {
//       stop.from(2).through(1).over(samples).through(3).to(9);
//       stop.reactsWithin(40ms);     a press is answered within so long
//       stop.freshWithin(30ms);      what an output rests on is no older
//   }
//
// Admission bounds both times, refuses the sketch where they are beyond these limits, and a run
// measures them. A release is taken to read from its begin on, and to have written when it ends: so
// ends the release with waitForNextPeriod(). sched/chain.h has the bounds.
#pragma once

#include "arduino/core/loops.h"
#include "runtime/chain.h"

namespace qduino::arduino {

/// The beginning of a chain, in setup(). The loops, the limits and the rest follow.
void begin_chain(runtime::Chain& chain, runtime::Chain::Source source, int pin, const char* words);
void add_to_chain(runtime::Chain& chain, int loop, Nanoseconds pass, bool queued);
void end_chain(runtime::Chain& chain, int pin, const char* words);
void limit_chain(runtime::Chain& chain, Nanoseconds reaction, Nanoseconds age);

}  // namespace qduino::arduino

template <typename T, std::size_t N>
class RingBuffer;
template <typename T>
class Channel;

/// At global scope. Every call is setup-time. What cannot stand is a refusal of admission, which
/// says why. A plain number of time is milliseconds.
class Chain {
  public:
    /// `name`: for people, up to 40 characters.
    explicit Chain(const char* name) : declaration_(name) {}

    /// The first loop reads `pin`, or what the words say ("thermistor").
    Chain& from(int pin) { return begin(Source::read, pin, nullptr); }
    Chain& from(const char* what) { return begin(Source::read, 0, what); }
    /// An edge of `pin`: its handler is the first stage (attachInterrupt(), attachInterruptVcpu()).
    Chain& fromEdge(int pin) { return begin(Source::edge, pin, nullptr); }
    /// An interrupt of a device, whose bottom half is the first stage (interruptsVcpu()): "gpio",
    /// "i2c", "spi", "uart", "nic" or "disk". A run measures from the first loop on.
    Chain& fromDevice(const char* device) { return begin(Source::device, 0, device); }

    /// Then comes `loop`.
    Chain& through(int loop) {
        qduino::arduino::add_to_chain(declaration_.chain(), loop, {}, queued_);
        queued_ = false;
        return *this;
    }
    /// Then comes `loop`, which owns its core and waits for no period: one pass of it takes `pass`
    /// at most.
    template <typename Duration>
    Chain& through(int loop, Duration pass) {
        qduino::arduino::add_to_chain(declaration_.chain(), loop, in_ms(pass), queued_);
        queued_ = false;
        return *this;
    }
    /// What the next loop takes the data from. It drains a ring at each release. Without over(): a
    /// variable.
    template <typename T, std::size_t N>
    Chain& over(const RingBuffer<T, N>&) {
        queued_ = true;
        return *this;
    }
    template <typename T>
    Chain& over(const Channel<T>&) {
        queued_ = false;
        return *this;
    }

    /// The last loop writes `pin`, or what the words say.
    Chain& to(int pin) {
        qduino::arduino::end_chain(declaration_.chain(), pin, nullptr);
        return *this;
    }
    Chain& to(const char* what) {
        qduino::arduino::end_chain(declaration_.chain(), 0, what);
        return *this;
    }

    /// From a change of the input to the output that answers it.
    template <typename Duration>
    Chain& reactsWithin(Duration limit) {
        qduino::arduino::limit_chain(declaration_.chain(), in_ms(limit), {});
        return *this;
    }
    /// From when an input is read to when an output that rests on it is written.
    template <typename Duration>
    Chain& freshWithin(Duration limit) {
        qduino::arduino::limit_chain(declaration_.chain(), {}, in_ms(limit));
        return *this;
    }

  private:
    using Source = qduino::runtime::Chain::Source;
    template <typename Duration>
    static qduino::Nanoseconds in_ms(Duration duration) {
        return qduino::arduino::to_duration(qduino::arduino::TimeUnit::ms, duration);
    }
    Chain& begin(Source source, int pin, const char* words) {
        qduino::arduino::begin_chain(declaration_.chain(), source, pin, words);
        return *this;
    }

    qduino::runtime::ChainDeclaration declaration_;
    bool queued_ = false;
};
