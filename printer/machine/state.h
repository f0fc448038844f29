// The states of the printer, and what may happen in each of them: one table, from which every
// change of state is read.
//
//    starting ─started─► idle ─begin─► printing ─pause─► pausing ─rest─► paused
//                         ▲             ▲  │               │  │            │ │
//                         ├──── end ────┼──┤               │  │            │ │
//                         │             └──┼──── resume ───┴──┼────────────┘ │
//                        end              stop               stop           stop
//                         │                ▼                  ▼              ▼
//                         └────────── cancelling ◄────────────┴──────────────┘
//
//    idle ──stop──► cancelling: it ends motion that somebody typed
//    any ──fault──► faulted ──clear──► idle
//
// The drawing has the events that change the state. Two kinds of event change nothing: a request
// for the present state (a second pause), and a person's request at the wrong time, which is
// refused with words. Every other pair cannot happen unless the program is wrong: Machine::to()
// then breaks a contract, which makes the pins safe and ends the program.
//
// `pausing` lasts until the head is parked. A job that is resumed is `printing` at once, also while
// it heats up and while the head goes back. `fault` is legal everywhere: safety never waits.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "printer/link/layout.h"

namespace qduino::printer::machine {

using State = link::MachineState;

enum class Event : std::uint8_t {
    started,  ///< loop 1 has its first release
    begin,    ///< a job has begun
    pause,    ///< a person, the job itself (M0) or lost heat asks for it
    rest,     ///< the head rests beside the path, or where it stopped
    resume,   ///< a person asks for it
    stop,     ///< a person cancels, or a line failed
    end,      ///< nothing moves any more, and nothing of the job is left
    fault,    ///< of the hardware, or an emergency stop
    clear,    ///< a person has mended the fault
};

inline constexpr std::array kAllStates{State::starting, State::idle,       State::printing, State::pausing,
                                       State::paused,   State::cancelling, State::faulted};
inline constexpr std::array kAllEvents{Event::started, Event::begin, Event::pause, Event::rest, Event::resume,
                                       Event::stop,    Event::end,   Event::fault, Event::clear};

/// What an event does in a state.
struct Next {
    enum class Kind : std::uint8_t {
        goes,        ///< to `state`
        stays,       ///< it is so already
        refused,     ///< nothing changes, and whoever asked is told `why`
        impossible,  ///< only a wrong program gets here
    };
    Kind kind = Kind::impossible;
    State state = State::starting;
    std::string_view why{};

    friend constexpr bool operator==(const Next&, const Next&) = default;
};

namespace transitions {

constexpr Next go(State state) { return {Next::Kind::goes, state}; }
constexpr Next no(std::string_view why) { return {Next::Kind::refused, State::starting, why}; }
inline constexpr Next same{Next::Kind::stays};
inline constexpr Next never{};

inline constexpr Next to_idle = go(State::idle), to_print = go(State::printing),
                      to_pause = go(State::pausing);
inline constexpr Next to_rest = go(State::paused), to_stop = go(State::cancelling),
                      to_fault = go(State::faulted);
inline constexpr Next no_job = no("nothing is printing"), no_pause = no("nothing is paused");
inline constexpr Next ends_now = no("the job is being cancelled"), no_fault = no("there is no fault");
inline constexpr Next in_fault = no("the machine has a fault; clear it first");

// clang-format off
inline constexpr Next kTable[kAllStates.size()][kAllEvents.size()]{
//                started  begin     pause     rest     resume    stop      end      fault     clear
/* starting   */ {to_idle, never,    never,    never,   never,    never,    never,   to_fault, never},
/* idle       */ {never,   to_print, no_job,   never,   no_pause, to_stop,  never,   to_fault, no_fault},
/* printing   */ {never,   never,    to_pause, never,   same,     to_stop,  to_idle, to_fault, no_fault},
/* pausing    */ {never,   never,    same,     to_rest, to_print, to_stop,  never,   to_fault, no_fault},
/* paused     */ {never,   never,    same,     never,   to_print, to_stop,  never,   to_fault, no_fault},
/* cancelling */ {never,   never,    ends_now, never,   ends_now, same,     to_idle, to_fault, no_fault},
/* faulted    */ {never,   never,    in_fault, never,   in_fault, in_fault, never,   to_fault, to_idle},
};
// clang-format on

}  // namespace transitions

/// Contract: both are values of their enums.
[[nodiscard]] constexpr Next next(State state, Event event) {
    return transitions::kTable[static_cast<std::size_t>(state)][static_cast<std::size_t>(event)];
}

/// As people call it.
[[nodiscard]] constexpr std::string_view name_of(Event event) {
    constexpr std::array<std::string_view, kAllEvents.size()> kNames{
        "start", "begin", "pause", "rest", "resume", "cancel", "end", "fault", "clear fault"};
    return kNames[static_cast<std::size_t>(event)];
}

}  // namespace qduino::printer::machine
