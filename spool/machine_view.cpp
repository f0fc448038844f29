#include "spool/machine_view.h"

#include <cmath>
#include <cstring>

namespace qduino::spool {

using namespace printer::link;

namespace {

/// Reads a one-byte field as a byte: to read a damaged field as its own type would be undefined.
template <typename Field>
std::uint8_t byte_of(const Field& field) {
    static_assert(sizeof(Field) == 1);
    std::uint8_t byte = 0;
    std::memcpy(&byte, &field, 1);
    return byte;
}

void make_bool(bool& field) {
    const bool value = byte_of(field) != 0;
    std::memcpy(&field, &value, 1);
}

/// A value out of range reads as `fallback`.
template <typename Enum>
void make_enum(Enum& field, Enum last, Enum fallback) {
    if (byte_of(field) > static_cast<std::uint8_t>(last)) std::memcpy(&field, &fallback, 1);
}

/// The supervisor's words. It writes them once, some time after it has marked the link as dead.
std::string note_of(const LinkLayout& layout) {
    if (layout.death_note_ready.load(std::memory_order_acquire) == 0) return {};
    std::string note;
    for (const char& c : layout.death_note) {
        if (c == '\0') break;
        note += static_cast<unsigned char>(c) < ' ' || c == '\x7f' ? ' ' : c;
    }
    return note;
}

}  // namespace

JobStatus checked(const JobStatus& raw) {
    JobStatus status;
    std::memcpy(static_cast<void*>(&status), &raw, sizeof status);
    // An unknown state must not look ready for a job, and an unknown outcome must not look like an
    // end.
    make_enum(status.state, MachineState::faulted, MachineState::faulted);
    make_enum(status.outcome, JobOutcome::failed, JobOutcome::running);
    for (bool& homed : status.homed) make_bool(homed);
    make_bool(status.parked);
    make_bool(status.may_jog);
    return status;
}

MotionStatus checked(const MotionStatus& raw) {
    MotionStatus status;
    std::memcpy(static_cast<void*>(&status), &raw, sizeof status);
    make_bool(status.moving);
    return status;
}

HeatStatus checked(const HeatStatus& raw) {
    HeatStatus status;
    std::memcpy(static_cast<void*>(&status), &raw, sizeof status);
    for (HeaterStatus* heater : {&status.hot_end, &status.bed}) {
        make_bool(heater->fault);
        make_bool(heater->reading);
    }
    make_bool(status.idle_timed_out);
    return status;
}

MachineView read_machine(const LinkLayout& layout) {
    MachineView view;
    view.connected = true;
    view.session = layout.session;
    const std::uint32_t dead = layout.sketch_dead.load(std::memory_order_acquire);
    view.life = dead == 0 ? SketchLife::alive : dead == 2 ? SketchLife::hung : SketchLife::died;
    if (view.life != SketchLife::alive) view.death_note = note_of(layout);
    const double time_factor = layout.time_factor.load(std::memory_order_relaxed);
    view.time_factor = std::isfinite(time_factor) && time_factor > 0 ? time_factor : 1;
    view.job = checked(layout.job_status.read());
    view.motion = checked(layout.motion_status.read());
    view.heat = checked(layout.heat_status.read());
    return view;
}

}  // namespace qduino::spool
