// tone(): a square wave by software, on a loop of its own.
//
// A tone must sound on any pin, without PWM, too, and go on while the sketch does other things. So
// a sketch that calls tone() gets one more loop, id 32, with 500 µs in every 5 ms; it is admitted
// and accounted for like every other. (Only such a sketch gets it: this file is linked for it
// alone.) The loop sleeps from edge to edge:
//
//   pin    ▔▔▔▔▁▁▁▁▔▔▔▔▁▁▁▁▔▔        edges at absolute instants: a late one does not shift the next
//   loop   ▌   ▌   ▌   ▌   ▌         awake for a pin write at each edge
//
// In setup(), when no loop runs yet, delay() plays.
//
// The sketch hands the tone over through a four-slot: neither side waits.
#include <algorithm>

#include "arduino/core/diagnostics.h"
#include "arduino/core/digital_io.h"
#include "arduino/core/lock.h"
#include "arduino/core/loops.h"
#include "arduino/core/timing.h"
#include "board/board.h"
#include "channel/four_slot.h"

namespace {

using qduino::Instant;
using qduino::Nanoseconds;
namespace board = qduino::board;

constexpr int kToneLoop = qduino::board::kMaxLoop;
constexpr Nanoseconds kToneBudget{500'000};
constexpr Nanoseconds kTonePeriod{5'000'000};
constexpr unsigned kLowestHz = 31;
constexpr unsigned kHighestHz = 65535;

/// A tone to play. A new `order` is a new wish, even of the same note.
struct Wish {
    std::uint64_t order = 0;
    std::int32_t pin = -1;
    Nanoseconds half_period{};  // zero: silence
    Instant end{};
};

qduino::channel::FourSlot<Wish> wishes;
// The four-slot has one writer; several loops may call tone().
qduino::arduino::Lock asking{"tone()", qduino::runtime::Unsaid::brief};
Wish asked;  // what was last written, under `asking`

void ask(int pin, Nanoseconds half_period, Instant end) {
    asked = Wish{asked.order + 1, pin, half_period, end};
    wishes.write(asked);
}

bool is_sounding(Instant now) { return asked.half_period.count() > 0 && now < asked.end; }

/// Plays the latest wish. One caller at a time: setup(), and then the loop.
class Player {
  public:
    /// Until `until`, or until there is nothing to play. True when something sounded.
    bool play_until(Instant until) {
        bool sounded = false;
        while (true) {
            const Wish wish = wishes.read();
            if (wish.order != order_) begin(wish);
            const Instant now = board::current().now();
            if (half_period_.count() == 0 || now >= wish.end || board::current().stop_requested()) break;
            if (now >= until) return sounded;  // to be gone on with: the pin stays as it is
            sounded = true;
            if (now >= edge_) {
                put_out(!high_);
                // Missed edges are not made up for.
                edge_ += half_period_ * (1 + (now - edge_) / half_period_);
            }
            board::current().sleep_until(std::min({edge_, wish.end, until}));
        }
        begin(Wish{order_});
        return sounded;
    }

  private:
    /// Leaves the pin of the tone before low.
    void begin(const Wish& wish) {
        if (high_) put_out(false);
        order_ = wish.order;
        pin_ = board::PinId{static_cast<std::uint16_t>(wish.pin)};
        half_period_ = wish.half_period;
        edge_ = board::current().now();
    }
    void put_out(bool high) {
        high_ = high;
        board::current().pin_write(pin_, high ? board::Level::high : board::Level::low);
    }

    std::uint64_t order_ = 0;
    board::PinId pin_{};
    Nanoseconds half_period_{};
    Instant edge_{};  // the next one
    bool high_ = false;
};

Player player QDUINO_BEFORE_SKETCH;

/// It waits for no period of its own: a tone's edges come when they come, and its budget bounds it.
/// Whether it "kept its periods" would be nothing that a sketch asked for.
void tone_loop() {
    const Instant next = board::current().now() + kTonePeriod;
    if (!player.play_until(next)) board::current().sleep_until(next);
}

/// Before the loops run there is no tone loop: setup() plays while it waits in delay().
void play_in_setup(Instant until) { player.play_until(until); }

const bool plays_in_setup = [] {
    qduino::arduino::set_setup_work(&play_in_setup);
    return true;
}();

const qduino::arduino::LoopRegistration tone_registration{kToneLoop,
                                                          kToneBudget,
                                                          kTonePeriod,
                                                          qduino::runtime::kAnyCore,
                                                          qduino::Nanoseconds{0},
                                                          0,
                                                          &tone_loop,
                                                          "tone()",
                                                          0};

}  // namespace

void tone(int pin, unsigned frequency_hz, unsigned long duration_ms) {
    if (pin < 0 || pin >= qduino::board::kPinCount || (frequency_hz != 0 && frequency_hz < kLowestHz) ||
        frequency_hz > kHighestHz) {
        qduino::arduino::refuse("tone", pin, qduino::ErrorCode::invalid_argument,
                                "a tone has a pin below 128 and 31 to 65535 Hz");
        return;
    }
    const qduino::arduino::LockGuard held{asking};
    const Instant now = board::current().now();
    if (is_sounding(now) && asked.pin != pin) return;
    qduino::arduino::make_output(pin);
    const Instant end = duration_ms == 0
                            ? qduino::kForever
                            : now + std::chrono::milliseconds{static_cast<std::int64_t>(duration_ms)};
    const Nanoseconds half_period{frequency_hz == 0 ? 0
                                                    : 500'000'000 / static_cast<std::int64_t>(frequency_hz)};
    ask(pin, half_period, end);
}

void noTone(int pin) {
    const qduino::arduino::LockGuard held{asking};
    if (asked.pin == pin) ask(pin, Nanoseconds{}, Instant{});
}
