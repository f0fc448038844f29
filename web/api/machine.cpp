// /api/v1/machine: what a person may do with the machine itself (docs/api.md, "Machine").
//
// A refusal here is a courtesy with a clear text; the machine checks everything again.
#include <array>
#include <cmath>

#include "web/api/guarantee.h"
#include "web/api/json.h"
#include "web/api/route.h"

namespace qduino::web::api {

namespace {

using printer::link::MachineState;

/// A number as G-code takes it.
Fixed decimal(double value) { return {value, 4}; }

/// A finite number of the body. False when the member is there and is none; `value` stays when it
/// is absent.
bool read_number(const Json& body, const char* name, std::optional<double>& value) {
    const auto at = body.find(name);
    if (at == body.end()) return true;
    if (!at->is_number() || !std::isfinite(at->get<double>())) return false;
    value = at->get<double>();
    return true;
}

bool is_busy(const spool::Spool& spool) {
    return spool.active_run().has_value() ||
           (spool.machine().connected && spool.machine().job.state != MachineState::idle);
}

Response busy() {
    return refused(ErrorCode::not_permitted, "not while the machine is printing, paused or faulted");
}

Response send(Context& context, const std::vector<std::string>& lines) {
    return answer(context.spool.gcode(lines), accepted());
}

Response get_machine(Context& context, const Call&) { return json_response(status_json(context.spool)); }

/// On the I/O thread: it must not wait for what the spool is doing.
Response emergency_stop(Context& context, const Call&) {
    return answer(context.spool.emergency().stop(), accepted());
}

Response home(Context& context, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body.empty() ? "{}" : call.request.body);
    const Json axes = body ? body->value("axes", Json("xyz")) : Json{};
    if (!axes.is_string())
        return refused(ErrorCode::invalid_argument, "give axes as a text of the letters x, y and z");
    std::string line = "G28";
    for (const char axis : axes.get<std::string>()) {
        const char upper = static_cast<char>(axis & ~0x20);
        if (upper != 'X' && upper != 'Y' && upper != 'Z')
            return refused(ErrorCode::invalid_argument, "only x, y and z can be homed");
        if (line.find(upper, 3) == std::string::npos) line.append(" ").push_back(upper);
    }
    if (line.size() == 3) return refused(ErrorCode::invalid_argument, "give at least one axis to home");
    if (is_busy(context.spool)) return busy();
    return send(context, {line});
}

/// The first axis that a jog would move without knowing its position; '\0': none.
char unhomed_axis(const Context& context, const std::array<std::optional<double>, 4>& by_mm) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (by_mm[axis] && *by_mm[axis] != 0 && !context.spool.machine().job.homed[axis]) return "XYZ"[axis];
    }
    return '\0';
}

struct Jog {
    std::array<std::optional<double>, 4> by_mm;
    std::optional<double> speed_mm_s;
};

/// True when the jog ends on the bed, as far as the axes have been homed.
bool stays_inside(const Context& context, const Jog& jog) {
    const auto& job = context.spool.machine().job;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (!jog.by_mm[axis] || !job.homed[axis]) continue;
        const double end_mm = job.position_mm[axis] + *jog.by_mm[axis];
        const printer::AxisConfig& config = context.machine.axes[axis];
        if (end_mm < config.minimum.value() - 1e-6 || end_mm > config.maximum.value() + 1e-6) return false;
    }
    return true;
}

Response jog(Context& context, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body);
    constexpr std::array kNames{"x_mm", "y_mm", "z_mm", "e_mm"};
    Jog jog;
    bool valid = body && read_number(*body, "speed_mm_s", jog.speed_mm_s);
    for (std::size_t axis = 0; valid && axis < 4; ++axis)
        valid = read_number(*body, kNames[axis], jog.by_mm[axis]);
    if (!valid)
        return refused(ErrorCode::invalid_argument, "give x_mm, y_mm, z_mm, e_mm and speed_mm_s as numbers");
    std::string line = "G1";
    double speed_mm_s = jog.speed_mm_s.value_or(1e9);
    if (speed_mm_s <= 0) return refused(ErrorCode::out_of_range, "the speed must be above 0");
    for (std::size_t axis = 0; axis < 4; ++axis) {
        if (!jog.by_mm[axis]) continue;
        if (std::abs(*jog.by_mm[axis]) > 1000)
            return refused(ErrorCode::out_of_range, "one jog is 1000 mm at most");
        write(line, ' ', "XYZE"[axis], decimal(*jog.by_mm[axis]));
        speed_mm_s = std::min(speed_mm_s, context.machine.axes[axis].max_speed.value());
    }
    if (line.size() == 2) return refused(ErrorCode::invalid_argument, "give at least one axis to jog");
    if (context.spool.machine().connected && !may_jog(context.spool)) return busy();
    if (const char axis = unhomed_axis(context, jog.by_mm); axis != '\0') {
        return refused(ErrorCode::not_permitted, "home first: nobody knows where ", axis,
                       " is before it has been homed");
    }
    if (!stays_inside(context, jog))
        return refused(ErrorCode::out_of_range, "the jog would leave the machine's bounds");
    return send(context,
                {"M83", "G91", text<std::string>(line, " F", decimal(speed_mm_s * 60)), "G90", "M82"});
}

Response temperature(Context& context, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body);
    std::optional<double> hot_end_c, bed_c;
    if (!body || !read_number(*body, "hot_end_c", hot_end_c) || !read_number(*body, "bed_c", bed_c) ||
        (!hot_end_c && !bed_c)) {
        return refused(ErrorCode::invalid_argument, "give hot_end_c or bed_c as a number");
    }
    if (bed_c && !context.machine.has_bed)
        return refused(ErrorCode::out_of_range, "this machine has no heated bed");
    const auto fits = [](std::optional<double> value, Celsius highest) {
        return !value || (*value >= 0 && *value <= highest.value());
    };
    const Celsius hot_end_highest = highest_target(context.machine.hot_end);
    if (!fits(hot_end_c, hot_end_highest)) {
        return refused(ErrorCode::out_of_range, "hot_end_c must be 0 to ",
                       std::lround(hot_end_highest.value()));
    }
    const Celsius bed_highest = highest_target(context.machine.bed);
    if (!fits(bed_c, bed_highest)) {
        return refused(ErrorCode::out_of_range, "bed_c must be 0 to ", std::lround(bed_highest.value()));
    }
    std::vector<std::string> lines;
    if (hot_end_c) lines.push_back(text<std::string>("M104 S", decimal(*hot_end_c)));
    if (bed_c) lines.push_back(text<std::string>("M140 S", decimal(*bed_c)));
    return send(context, lines);
}

Response fan(Context& context, const Call& call) {
    const std::optional<Json> body = object_of(call.request.body);
    std::optional<double> duty;
    if (!body || !read_number(*body, "duty", duty) || !duty)
        return refused(ErrorCode::invalid_argument, "give duty as a number");
    if (*duty < 0 || *duty > 1) return refused(ErrorCode::out_of_range, "duty must be 0 to 1");
    return send(context, {text<std::string>("M106 S", decimal(*duty * 255))});
}

Response gcode(Context& context, const Call& call) {
    const std::optional<std::string> line = text_member(call.request.body, "line");
    if (!line) return refused(ErrorCode::invalid_argument, "give line as a text");
    return answer(send_checked(context, {*line}), accepted());
}

Response guarantee(Context& context, const Call&) {
    std::optional<Json> report = checked_guarantee(context.spool.guarantee());
    if (!report) return refused(ErrorCode::unavailable, "the machine has published no guarantee report");
    const Json own = Json::parse(context.own_vcpu_json ? context.own_vcpu_json() : "", nullptr, false);
    (*report)["service"] = own.is_object() ? own : Json(nullptr);
    return json_response(*report);
}

Response config(Context& context, const Call&) { return {.body = context.config_json}; }

constexpr std::array kMachineRoutes{
    Route{Method::get, "/api/v1/machine", get_machine},
    Route{Method::post, "/api/v1/machine/pause", act<&spool::Spool::pause>},
    Route{Method::post, "/api/v1/machine/resume", act<&spool::Spool::resume>},
    Route{Method::post, "/api/v1/machine/cancel", act<&spool::Spool::cancel>},
    Route{Method::post, "/api/v1/machine/clear-fault", act<&spool::Spool::clear_fault>},
    Route{Method::post, "/api/v1/machine/bed-cleared", act<&spool::Spool::bed_cleared>},
    Route{Method::post, "/api/v1/machine/emergency-stop", emergency_stop, Thread::io},
    Route{Method::post, "/api/v1/machine/home", home},
    Route{Method::post, "/api/v1/machine/jog", jog},
    Route{Method::post, "/api/v1/machine/temperature", temperature},
    Route{Method::post, "/api/v1/machine/fan", fan},
    Route{Method::post, "/api/v1/machine/gcode", gcode},
    Route{Method::get, "/api/v1/guarantee", guarantee},
    Route{Method::get, "/api/v1/config", config},
};

}  // namespace

std::span<const Route> machine_routes() { return kMachineRoutes; }

}  // namespace qduino::web::api
