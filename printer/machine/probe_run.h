// Measures the bed on the motion pipe, one point of the grid after the other:
//
//   over    up to the clearance, then sideways until the probe is above the point
//   down    slowly, until the probe triggers: loop 2 then sends no more steps of what moves the
//           nozzle down. Its counts say how high the nozzle is
//   … the next point; at the end up again, and a rest
//
// The nozzle goes down to kTooLow_mm below the bed at most; no trigger until then is an error, and
// so is one before the nozzle has moved.
//
// Loop 1 only. As homing_run.h, one order at a time: it begins when everything before it has been
// played.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "printer/machine/motion_pipe.h"
#include "printer/machine/motors.h"
#include "printer/motion/bed_mesh.h"

namespace qduino::printer::machine {

class ProbeRun {
  public:
    /// The nozzle goes so far below the bed at most.
    static constexpr double kTooLow_mm = 5;
    /// It rests so long when all is measured.
    static constexpr double kRest_s = 0.1;

    /// All must outlive this.
    ProbeRun(const MachineConfig& config, MotionPipe& pipe, Motors& motors)
        : config_(config), kinematics_(config), pipe_(pipe), motors_(motors) {}

    /// The mesh in force is no longer followed. Contract: the machine has a probe, and is homed.
    void begin();
    [[nodiscard]] bool active() const { return phase_ != Phase::none; }
    /// One look, once per release while active. True: all is measured, and the mesh is followed
    /// from the next move on. Error: it is over, and has failed.
    [[nodiscard]] Result<bool> advance(bool may_start);
    /// Loop 2 has dropped the rest of a way down, and the pipe stands where the nozzle does.
    [[nodiscard]] Result<void> stopped();
    void abandon() { phase_ = Phase::none; }

  private:
    enum class Phase : std::uint8_t { none, over, down, up };

    void start();
    void go(const motion::AxisVector& to, double speed_mm_s);
    [[nodiscard]] Error failed(std::string_view why);

    const MachineConfig& config_;
    Kinematics kinematics_;
    MotionPipe& pipe_;
    Motors& motors_;
    Phase phase_ = Phase::none;
    bool running_ = false;
    std::size_t point_ = 0;
    std::uint32_t hits_ = 0;
    std::int64_t pulses_ = 0;
    motion::BedMesh mesh_;
};

}  // namespace qduino::printer::machine
