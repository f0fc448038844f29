// Reads a whole job before anything is heated: would it stay within this machine's bounds,
// temperatures and step rate?
//
//   chunks ─► Parser ─┬─ comments ─► Metadata, Thumbnail, LayerTracker
//                     └─ commands ─► Interpreter ─► (as Actions) checks, bounds ─► MoveSinks
//                        the same as in the machine
//
// A second reading of G-code could understand a job differently from the printer. So lexer, parser
// and interpreter are those that print.
//
// Sans I/O. Memory does not depend on the length of the file: a few kilobytes, and the thumbnail
// (at most 1 MB while it is read). Once the bytes have turned out to be no G-code, feed() parses
// nothing more. Not for real-time loops (a thumbnail is on the heap).
//
// It has more members than other classes, because each reader in the drawing is one.
#pragma once

#include <array>
#include <span>
#include <string_view>

#include "base/fixed_vector.h"
#include "printer/gcode/interpreter.h"
#include "printer/gcode/no_actions.h"
#include "printer/gcode/parser.h"
#include "printer/preflight/facts.h"
#include "printer/preflight/file_end.h"
#include "printer/preflight/layer_tracker.h"
#include "printer/preflight/move_sink.h"

namespace qduino::printer::preflight {

class Preflight final : private gcode::NoActions {
  public:
    static constexpr std::size_t kSinksMax = 4;

    explicit Preflight(const MachineConfig& machine);
    Preflight(const Preflight&) = delete;
    Preflight& operator=(const Preflight&) = delete;

    /// Before the first feed(). `sink` must outlive the pre-flight. Contract: at most kSinksMax.
    void add_sink(MoveSink& sink);

    /// The next bytes of the file, in any pieces.
    void feed(std::span<const char> bytes);
    /// The file has ended. Call once.
    const Facts& finish();
    /// The facts so far.
    [[nodiscard]] const Facts& facts() const { return facts_; }
    /// True as soon as nothing that follows can make this job fit: it is no G-code, or breaks a
    /// rule that no prologue mends. Facts::first_error() is then what finish() would give, too.
    [[nodiscard]] bool is_refused() const { return judged_ && facts_.unmendable.has_value(); }

  private:
    static constexpr std::size_t kLookBytes = 4096;

    // gcode::Actions, as far as it matters here
    Result<void> move(const gcode::Move& move) override;
    Result<void> dwell(Seconds duration) override;
    Result<void> home(gcode::AxisSet axes) override;
    Result<void> probe_bed() override;
    Result<void> set_temperature(gcode::Heater heater, Celsius target) override;
    Result<void> wait_temperature(gcode::Heater heater, Celsius target, gcode::WaitFor direction) override;
    Result<void> set_limits(const gcode::LimitChange& change) override;
    Result<void> pause(const gcode::PauseOrder& order) override;
    Result<void> motors_off(gcode::AxisSet axes) override;
    void emergency_stop() override;
    void progress(const gcode::Progress& progress) override;
    void note(gcode::NoteKind kind, std::string_view text, const gcode::Source& source) override;

    void on_line(const gcode::Line& line);
    void look(std::span<const char> bytes);
    void judge_content();
    [[nodiscard]] Result<void> heed(const gcode::Line& line);
    void on_comment(const gcode::Line& line);
    void check_homed(const gcode::Move& move);
    void check_extrusion(const gcode::Move& move);
    void check_step_rate(const gcode::Move& move);
    void check_motor_rate(Axis motor, double rate_hz);
    void check_whole();
    void check_end();
    void measure_layers(const MoveContext& context);
    void take_target(gcode::Heater heater, Celsius target);
    void add_error(std::string_view message, std::string_view advice);
    void add_start_error(std::string_view message, std::string_view advice);
    void add_warning(std::string_view message, std::string_view advice);
    [[nodiscard]] Finding finding(std::string_view message, std::string_view advice) const;

    MachineConfig machine_;
    Kinematics kinematics_;
    Facts facts_;
    gcode::Parser parser_;
    gcode::Interpreter interpreter_;
    ThumbnailReader thumbnail_;
    LayerTracker layers_;
    FileEnd end_;
    FixedVector<MoveSink*, kSinksMax> sinks_;
    PerAxis<MillimetresPerSecond> speed_max_{};
    Celsius bed_target_{};
    Celsius hot_end_target_{};
    PerAxis<bool> was_homed_{};
    Celsius waited_for_{};  ///< the hot end has been waited for, and was as warm as this
    bool told_cold_ = false;
    Celsius minimum_extrude_{};   ///< M302
    PerAxis<bool> let_go_{};      ///< … and its motors have gone off since
    bool said_ended_ = false;     ///< that lines stand behind the program's end
    Millimetres filament_end_{};  ///< the furthest that E has been
    double top_layer_z_mm_ = 0;
    double first_layer_z_mm_ = 0;
    const gcode::Line* line_ = nullptr;  ///< in hand, during on_line

    std::array<char, kLookBytes> head_{};
    std::size_t head_count_ = 0;
    bool judged_ = false;
    bool refused_ = false;  ///< no G-code: nothing more is parsed
};

}  // namespace qduino::printer::preflight
