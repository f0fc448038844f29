#include "arduino/libraries/Encoder/Encoder.h"

#include <array>
#include <utility>

#include "arduino/core/diagnostics.h"
#include "arduino/core/loops.h"
#include "base/fixed_vector.h"
#include "runtime/runtime.h"

namespace {

constexpr int kMost = 32;
constinit qduino::FixedVector<Encoder*, kMost> watched;

/// How far `to` is from `from`: a jump of two goes the way that two edges of pin 1 would.
constexpr int way(std::int32_t from, std::int32_t to) {
    if (from < 0) return 0;
    const int moved = (to - from) & 3;
    return moved == 2 ? (to % 2 == 0 ? 2 : -2) : moved == 3 ? -1 : moved;
}

}  // namespace

template <int Index>
void Encoder::edge() {
    watched[Index]->look();
}

void Encoder::look_at_all() {
    for (Encoder* encoder : watched) encoder->look();
}

Encoder::Encoder(int pin1, int pin2, bool by_interrupts) : pin1_(pin1), pin2_(pin2) {
    static constexpr auto kHandlers = []<int... Index>(std::integer_sequence<int, Index...>) {
        return std::array{&Encoder::edge<Index>...};
    }
    (std::make_integer_sequence<int, kMost>{});

    pinMode(pin1_, INPUT_PULLUP);
    pinMode(pin2_, INPUT_PULLUP);
    const std::size_t index = watched.size();
    if (!watched.try_push_back(this)) {
        qduino::arduino::refuse("Encoder", pin1, qduino::ErrorCode::unavailable,
                                "32 encoders are watched; this one is followed by read() alone");
        return;
    }
    if (by_interrupts) {
        for (const int pin : {pin1_, pin2_})
            attachInterrupt(digitalPinToInterrupt(pin), kHandlers[index], CHANGE);
    }
    // The wires cannot be read before the board is there.
    if (qduino::runtime::Runtime::current() == nullptr)
        qduino::arduino::before_setup(&look_at_all);
    else
        look();
}

Encoder::Seen Encoder::look() {
    Seen before = seen_.load(), after{};
    do {
        const bool first = digitalRead(pin1_) == HIGH, second = digitalRead(pin2_) == HIGH;
        const std::int32_t phase = first ? (second ? 2 : 3) : (second ? 1 : 0);
        after = {before.position + static_cast<std::uint32_t>(way(before.phase, phase)), phase};
    } while (!seen_.compare_exchange_weak(before, after));
    return after;
}

std::int32_t Encoder::read() { return static_cast<std::int32_t>(look().position); }

std::int32_t Encoder::readAndReset() {
    look();
    return exchange(0);
}

std::int32_t Encoder::exchange(std::int32_t position) {
    Seen before = seen_.load();
    while (!seen_.compare_exchange_weak(before, {static_cast<std::uint32_t>(position), before.phase})) {
    }
    return static_cast<std::int32_t>(before.position);
}
