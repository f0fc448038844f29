// What a board may have besides the Board concept, and what is done where it has not.
//
// A hook is a member function found by its shape when the program is compiled: a board without it costs nothing and is
// told nothing. What a sketch asks for and its board cannot do is answered with `unsupported`, never silently.
#pragma once

#include "base/result.h"
#include "board/types.h"
#include "sched/admission.h"

namespace qduino::runtime::hooks {

/// The calling loop begins a release (a trace event; a sign of life for a supervisor).
template <typename Board>
void note_release(Board& board) {
    if constexpr (requires { board.note_release(); }) board.note_release();
}

/// The calling loop's release ended after its next was due.
template <typename Board>
void note_overrun(Board& board) {
    if constexpr (requires { board.note_overrun(); }) board.note_overrun();
}

/// The calling loop's body returned without having waited for its next period, and will be called again. On a board
/// that does not ask for more it is a sign of life.
template <typename Board>
void note_body_end(Board& board) {
    if constexpr (requires { board.note_body_end(); }) {
        board.note_body_end();
    } else {
        note_release(board);
    }
}

/// What the platform itself takes on `core`, for admission.
template <typename Board>
sched::PlatformOverheads platform_overheads(Board& board, int core) {
    if constexpr (requires {
                      { board.platform_overheads(core) } -> std::same_as<sched::PlatformOverheads>;
                  }) {
        return board.platform_overheads(core);
    } else {
        static_cast<void>(board), static_cast<void>(core);
        return {};
    }
}

template <typename Board>
Result<void> serve_interrupts(Board& board, board::DeviceClass device, board::VcpuId io) {
    if constexpr (requires { board.serve_interrupts(device, io); }) {
        return board.serve_interrupts(device, io);
    } else {
        static_cast<void>(board), static_cast<void>(device), static_cast<void>(io);
        return make_error(ErrorCode::unsupported,
                          "interruptsVcpu: this board cannot give a device's bottom half to an I/O VCPU");
    }
}

template <typename Board>
Result<void> route_interrupts(Board& board, board::DeviceClass device, int core, bool allowed) {
    if constexpr (requires { board.route_interrupts(device, core, allowed); }) {
        return board.route_interrupts(device, core, allowed);
    } else {
        static_cast<void>(board), static_cast<void>(device), static_cast<void>(core),
            static_cast<void>(allowed);
        return make_error(ErrorCode::unsupported,
                          "noInterrupts: this board cannot route a device's interrupts");
    }
}

template <typename Board>
Result<void> core_timer(Board& board, int core, bool enabled) {
    if constexpr (requires { board.core_timer(core, enabled); }) {
        return board.core_timer(core, enabled);
    } else {
        static_cast<void>(board), static_cast<void>(core), static_cast<void>(enabled);
        return make_error(ErrorCode::unsupported, "noTimer: this board cannot stop a core's scheduling tick");
    }
}

}  // namespace qduino::runtime::hooks
