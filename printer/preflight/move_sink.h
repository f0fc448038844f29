// Receives what a job does while it is read, before it is printed: the layer packer takes the
// moves, the estimate everything that takes time.
#pragma once

#include <cstdint>
#include <optional>

#include "printer/gcode/actions.h"
#include "printer/gcode/annotation.h"

namespace qduino::printer::preflight {

/// A layer exists once something has been extruded in it.
struct Layer {
    std::uint32_t index = 0;       ///< from 0
    double z_mm = 0;               ///< of the first extrusion in it
    double height_mm = 0;          ///< by comment, else above the layer before; 0: not known
    std::uint64_t first_byte = 0;  ///< of the comment or move that began it
};

/// What the file's comments say about a move.
struct MoveContext {
    Layer layer;  ///< meaningful from the first extruding move on
    gcode::Feature feature = gcode::Feature::unknown;
    double width_mm = 0;    ///< of the extrusion, by comment; 0: not known
    bool extrudes = false;  ///< the tool moves and pushes filament forward
};

/// Called in the order of the file. An implementation must define on_move alone.
class MoveSink {
  public:
    virtual ~MoveSink() = default;
    /// `context.layer` changes with the first extruding move of a layer.
    virtual void on_move(const gcode::Move& move, const MoveContext& context) = 0;
    // Everything else that takes time, as gcode::Actions says it.
    virtual void on_dwell(Seconds /*duration*/) {}
    virtual void on_home(gcode::AxisSet /*axes*/) {}
    virtual void on_probe() {}
    /// `wait`: the job is held until the target is reached.
    virtual void on_temperature(gcode::Heater /*heater*/, Celsius /*target*/,
                                std::optional<gcode::WaitFor> /*wait*/) {}
    virtual void on_limits(const gcode::LimitChange& /*change*/) {}
    /// The motion comes to rest: a pause.
    virtual void on_pause() {}
    /// Motors go off. Nothing more is read before that. `unhomed`: nobody knows where these are
    /// then.
    virtual void on_motors_off(gcode::AxisSet /*unhomed*/) {}
    /// The job has ended. `bytes` is its length.
    virtual void on_end(std::uint64_t /*bytes*/) {}
};

}  // namespace qduino::printer::preflight
