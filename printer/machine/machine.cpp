#include "printer/machine/machine.h"

#include "base/version.h"
#include "printer/gcode/reports.h"
#include "printer/machine/vectors.h"

namespace qduino::printer::machine {

using link::JobOutcome;
using link::ReplyKind;

namespace {

/// M105.
gcode::ReportText temperatures(const link::HeatStatus& heat, bool has_bed) {
    const auto reading = [](const link::HeaterStatus& h) {
        return gcode::HeaterReading{Celsius{h.celsius}, Celsius{h.target_celsius}, h.duty};
    };
    return gcode::format_temperatures(reading(heat.hot_end),
                                      has_bed ? std::optional{reading(heat.bed)} : std::nullopt);
}

/// M114.
gcode::ReportText position(const gcode::Position& shown, const MotionPipe& pipe) {
    StepCounts steps = pipe.seen().steps;
    for (std::size_t i = 0; i < kAxisCount; ++i) steps[i] -= pipe.scale().origin()[i];
    return gcode::format_position(shown, steps);
}

/// M301, M304, M306 without a number, M503.
void report_heat(LinkEnd& link, const Heating& heating, const MachineConfig& config, gcode::Report what) {
    using gcode::Report;
    for (const gcode::Heater heater : {gcode::Heater::hot_end, gcode::Heater::bed}) {
        const bool bed = heater == gcode::Heater::bed;
        if (bed && !config.has_bed) continue;
        const HeaterSettings& settings = heating.settings(heater);
        const bool all = what == Report::heat_settings;
        if (all || what == (bed ? Report::bed_gains : Report::hot_end_gains))
            link.say(ReplyKind::text, gcode::format_gains(heater, settings));
        if (all || what == (bed ? Report::bed_model : Report::hot_end_model))
            link.say(ReplyKind::text, gcode::format_model(heater, settings.model, filament_area_mm2(config)));
    }
}

}  // namespace

Machine::Machine(const MachineConfig& config, link::LinkLayout& link, MotorSwitch& motors)
    : config_(config),
      link_(link),
      motors_(Kinematics{config_}, motors),
      pipe_(config_, link.emergency),
      heating_(config_, link.heat_status),
      homing_(config_, pipe_, motors_),
      profiles_(config_),
      base_(pipe_, heating_, motors_),
      actions_({config_, link_, pipe_, motors_, heating_, places_, homing_, profiles_}),
      parking_(config_, pipe_, heating_, motors_, actions_),
      job_(config_, actions_, link_, places_) {
    pipe_.correction().set_mesh(profiles_.kept_in_force());
    base_.take();
}

heat::HeatDuties Machine::heat_sample(Instant now, const heat::HeatReadings& readings) {
    heat::HeatReadings seen = readings;
    seen.step_pulses = pipe_.pulses();
    seen.filament_steps = pipe_.filament_steps();
    return heating_.sample(now, seen, pipe_.stops().emergency_pending());
}

bool Machine::to(Event event) {
    const Next next = machine::next(state_, event);
    QDUINO_EXPECT(next.kind != Next::Kind::impossible);
    if (next.kind == Next::Kind::refused)
        link_.say(ReplyKind::warning, text(name_of(event), " was not taken: ", next.why));
    if (next.kind != Next::Kind::goes) return false;
    state_ = next.state;
    return true;
}

// ---- one release, in order ----------------------------------------------------------------------

void Machine::plan(Instant now) {
    pipe_.observe();
    if (state_ == State::starting) to(Event::started);
    if (pipe_.stops().emergency_pending()) {
        enter_fault("emergency stop");
        pipe_.stops().take_emergency();
    }
    watch_heat(now);
    take_in_motion();
    link_.take_commands([this](const link::CommandText& command) { serve(command); });
    advance_homing(now);
    if (places_.all_passed()) {  // else the target is not yet in force
        heating_.advance_wait(now);
        advance_tuning();
    }
    advance_hold();
    advance_excursion();
    while (console_is_ready() && runs_at_once()) run_typed_line();
    feed_motion();
    watch_motors(now);
    const bool played = state_ == State::printing && !parking_.away() && job_.read_to_end() &&
                        !heating_.holds() && !homing_.active() && !pending() && !pipe_.stops().running() &&
                        pipe_.drained() && places_.all_passed();
    if (played) {
        link_.status().bytes_executed = link_.status().job_length;
        job_.will_end({JobOutcome::completed});
        if (!takes_leave()) end_job(job_.ending());
    }
    publish(now);
}

/// A job that ends, fails or is cancelled leaves no heat, and no nozzle below the top of the part.
/// One that has only heated was wanted for that: the idle watch looks after its heat. True: the
/// head goes up and beside the part; the job ends when it has. Contract: everything rests.
bool Machine::takes_leave() {
    if (!actions_.printed().empty()) heating_.all_off();
    const bool may = config_.park.enabled && homing_.all_homed() && !pipe_.stops().running();
    if (!job_.running() || !may || !actions_.printed().reaches(pipe_.asked_mm()[2])) return false;
    const bool rests = pipe_.come_to_rest();
    if (rests) parking_.take_leave(actions_.printed());
    return rests;
}

/// … and it has.
void Machine::end_left_job() {
    ++link_.status().excursions;
    places_.forget();
    pipe_.reset(pipe_.planner().position_mm());
    job_.stands_at(pipe_.asked_mm());
    end_job(job_.ending());
}

/// A fault of the heat stops everything. When loop 3 has cut heaters that nobody used, a job that
/// runs is paused before it moves on without heat.
void Machine::watch_heat(Instant now) {
    heating_.observe(now);
    if (state_ != State::faulted && !heating_.fault().empty()) enter_fault(heating_.fault());
    if (!heating_.idle_lost()) return;
    if (job_.running()) {
        heating_.keep_targets();
    } else {
        heating_.forget_wait();
    }
    heating_.heaters_off();
    if (state_ == State::printing) pause_job(false);
    link_.say(
        ReplyKind::warning,
        text("nobody used the heaters for ", Fixed{heating_.seen().idle_timeout_s, 0}, " s: they are off",
             job_.running() ? "; the job is paused, and heats up again first when it is resumed" : ""));
}

/// What an experiment has found is told in the words that put it in force.
void Machine::advance_tuning() {
    const auto over = heating_.advance_tuning();
    if (!over) return;
    const gcode::TuningAsked& asked = over->asked;
    if (over->report.state == heat::TuningState::failed) {
        const auto why = text("tuning of the ", asked.heater == gcode::Heater::bed ? "bed" : "hot end",
                              " has failed: ", over->report.why.view());
        if (job_.running()) return stop_job(JobOutcome::failed, why);
        return link_.say(ReplyKind::error, why);
    }
    const HeaterSettings& found = over->report.found;
    const bool gains = asked.kind == HeaterControl::pid;
    link_.say(ReplyKind::text,
              gains ? gcode::format_tuned_gains(asked.heater, found)
                    : gcode::format_model(asked.heater, found.model, filament_area_mm2(config_)));
    link_.say(ReplyKind::text,
              asked.use ? "in force; M500 keeps it" : "not in force yet: type the line above");
}

/// M84 S. A machine at rest loses nothing but the places of its axes.
void Machine::watch_motors(Instant now) {
    const bool in_use = state_ != State::idle || !pipe_.drained() || homing_.active() || heating_.holds() ||
                        pipe_.stops().running() || pending();
    if (!motors_.timed_out(now, in_use)) return;
    motors_.off(gcode::AxisSet::all());
    homing_.forget(gcode::AxisSet::all());
    homing_.tell(job_.interpreter());
}

/// What has been played, and where a stop has left the machine: loop 2 has dropped everything, and
/// counts its steps.
void Machine::take_in_motion() {
    if (pipe_.stopping()) return;
    if (!pipe_.stops().running()) {
        places_.pass(pipe_.seen().last_marker, [this](const Place& place) { actions_.pass(place); });
        return;
    }
    places_.forget();
    homing_.locate();
    pipe_.reset(pipe_.scale().position_of(pipe_.seen().steps, pipe_.planner().position_mm()));
    tell_place(homing_.active());
    if (const Result<void> homing = homing_.stopped(); !homing.ok()) enter_fault(homing.error().message);
}

void Machine::advance_homing(Instant now) {
    if (!homing_.active()) return;
    const bool probes = homing_.probes();
    const Result<bool> settled = homing_.advance(now, pipe_.drained() && places_.all_passed());
    if (!settled.ok()) return enter_fault(settled.error().message);
    if (!*settled) return;
    if (!probes) return tell_place(true);
    // Where the probe has left it counts as asked for, without the bed that it has found.
    job_.stands_at(pipe_.planner().position_mm());
    pipe_.correction().adjust();
    base_.take_bed();
}

/// The machine stands somewhere else than the moves said. While it homes in corrected coordinates
/// the interpreter is right already: its next move leads there from wherever the switch is.
void Machine::tell_place(bool homing) {
    motion::Correction& correction = pipe_.correction();
    if (homing && correction.active()) return correction.adjust();
    job_.stands_at(pipe_.asked_mm());
}

/// Pausing and cancelling: the motion comes to rest at the end of a move, then the state changes.
void Machine::advance_hold() {
    const bool pausing = state_ == State::pausing && !parking_.away();
    const bool cancelling = state_ == State::cancelling;
    if ((!pausing && !cancelling) || homing_.active() || pipe_.stops().running()) return;
    if (parking_.takes_leave()) return;
    if (pausing && parking_.waits_for_end()) return;
    if (!pipe_.come_to_rest()) return;
    if (pausing) {
        if (!parking_.leave(job_.interpreter(), homing_, actions_.printed())) {
            link_.say(ReplyKind::warning,
                      "paused where the head stands: it parks only when all axes have been homed");
        }
        return;
    }
    if (takes_leave()) return;
    pipe_.planner().discard_held();
    places_.forget();
    pipe_.reset(pipe_.planner().position_mm());
    job_.stands_at(pipe_.asked_mm());
    end_job(job_.ending());
}

void Machine::advance_excursion() {
    const bool goes_on = (state_ != State::cancelling || parking_.takes_leave()) && state_ != State::faulted;
    if (!parking_.away() || !goes_on || pipe_.stops().running()) return;
    const Result<Parking::Step> step = parking_.advance();
    if (!step.ok()) return enter_fault(step.error().message);
    if (*step == Parking::Step::arrived) {
        parking_.stay();
        to(Event::rest);
        if (parking_.take_deferred_resume()) resume_job();
    } else if (*step == Parking::Step::left) {
        end_left_job();
    } else if (*step == Parking::Step::returned) {
        ++link_.status().excursions;
        // Paused again on the way: the path is still held, and the head leaves it again.
        if (state_ == State::pausing) return;
        heating_.forget_kept();
        pipe_.planner().resume();
    }
}

// ---- what the service asks for ------------------------------------------------------------------

void Machine::serve(const link::CommandText& command) {
    switch (command.command) {
        case link::Command::pause:
            return pause_job(false);
        case link::Command::resume:
            return resume_job();
        case link::Command::cancel:
            return cancel_job();
        case link::Command::clear_fault:
            return clear_fault();
        case link::Command::gcode:
            return take_line(command.text, Speaker::person);
        case link::Command::host_line:
            return take_line(command.text, Speaker::host);
    }
}

/// Emergency codes act here, before the lines that wait; every other line waits for its turn.
void Machine::take_line(std::string_view line, Speaker speaker) {
    const bool of_host = speaker == Speaker::host;
    const bool counts = of_host && !line.empty();
    gcode::EmergencyScanner scanner;
    gcode::EmergencyCodes codes = scanner.feed(line);
    codes.add(scanner.feed("\n"));
    if (act_on(codes)) {
        if (of_host) return host_.refuse();
        return link_.say(ReplyKind::text, "ok");
    }
    const Result<void> taken = console_.take(line, speaker);
    if (taken.ok()) return;
    link_.answer_host(of_host);
    link_.say(ReplyKind::error, taken.error().message);
    link_.answer_host(false);
    if (counts) host_.refuse();
}

/// True: there was one.
bool Machine::act_on(const gcode::EmergencyCodes& codes) {
    if (codes.stop) enter_fault("emergency stop (M112)");
    if (codes.break_wait) {
        heating_.wait().clear();
        host_.let_go();
        if (state_ == State::paused) resume_job();
    }
    if (codes.stop_moves) stop_moves();
    return codes.any();
}

/// A serial host has come: it knows nothing of the modes that the lines before have left.
void Machine::begin_host() {
    if (job_.running() || parking_.away()) return;
    job_.interpreter().reset_modes();
    actions_.factors(1, 1);
    homing_.tell(job_.interpreter());
    forget_settings();
}

/// Drops what a job or a host has set: nothing of it is left to the next (base_settings.h).
void Machine::forget_settings() {
    base_.restore();
    job_.interpreter().set_skew(pipe_.correction().skew());
}

/// M410. What waits is dropped as well: it counted on the moves.
void Machine::stop_moves() {
    if (state_ != State::idle) {
        return link_.say(ReplyKind::warning,
                         "M410 was not taken: only moves that were typed or that a host sent are stopped so");
    }
    host_.drop(console_.forget());
    job_.interpreter().drop_pending();
    actions_.forget_rest();
    if (homing_.active()) {
        homing_.abandon();
        homing_.tell(job_.interpreter());
    }
    pipe_.stops().ask();
}

void Machine::pause_job(bool at_end) {
    if (parking_.takes_leave()) return link_.say(ReplyKind::warning, "pause was not taken: the job is over");
    if (!to(Event::pause)) return;
    parking_.pause_at_end(at_end);
    if (!parking_.heats()) return;
    parking_.stay();
    to(Event::rest);
}

/// The job would fail at its next move of filament, and the part be lost for one press of a button.
void Machine::pause_without_heat(const HeatTaken& taken) {
    if (state_ != State::printing) return;
    pause_job(false);
    const std::string_view heater = taken.heater == gcode::Heater::bed ? "bed" : "hot end";
    const auto what =
        taken.target.value() > 0
            ? text("the ", heater, " was set to ", Shortest{taken.target.value()}, " °C, too cold to print")
            : text("the ", heater, " was switched off");
    link_.say(ReplyKind::warning,
              text(what, ": the job is paused, and heats up again first when it is resumed"));
}

void Machine::resume_job() {
    if (state_ == State::pausing && parking_.defers_resume()) return;
    if (!to(Event::resume)) return;
    parking_.pause_at_end(false);
    if (parking_.rests()) return parking_.begin_return();
    if (!parking_.away()) pipe_.planner().resume();
}

void Machine::cancel_job() {
    const bool nothing_to_stop =
        state_ == State::idle && !heating_.holds() && !homing_.active() && pipe_.drained();
    if (parking_.takes_leave()) return;  // it is over
    if (nothing_to_stop) return link_.say(ReplyKind::warning, "cancel was not taken: nothing is printing");
    stop_job(JobOutcome::cancelled, "cancelled");
}

void Machine::clear_fault() {
    const bool faulted = state_ == State::faulted;
    if (faulted && pipe_.stops().running()) {
        return link_.say(ReplyKind::warning, "clear fault was not taken: the motors are still being stopped");
    }
    if (const auto persists = heating_.persisting_fault(); faulted && !persists.empty())
        return link_.say(ReplyKind::error, text("the fault is still there: ", persists));
    if (!to(Event::clear)) return;
    heating_.clear_faults();
    link_.status().fault.clear();
    link_.say(ReplyKind::text, "fault cleared: home the axes before the next move");
}

// ---- lines --------------------------------------------------------------------------------------

bool Machine::reads() const {
    const bool takes_lines = state_ == State::idle || state_ == State::printing;
    return takes_lines && !parking_.away() && !heating_.holds() && !homing_.active() &&
           !places_.motors_go_off();
}

/// Reads and solves by turns. Moves may be so short that a full planner lasts for less than a
/// release; what it gives out makes room for more.
///
/// What has been read can no longer be changed by M220, nor left out. So lines are read only while
/// the solver is hungry, and a few at a time: each time the planner plans anew.
void Machine::feed_motion() {
    int lines = kLinesPerPlan;
    std::size_t events = pipe_.pump(true, MotionPipe::kEventsPerPump);
    for (int before = 0; events > 0 && lines > 0 && lines != before;) {
        before = lines;
        const bool more_may_come = read_input(lines);
        events = pipe_.pump(more_may_come, events);
    }
}

/// At most so many `lines`, which it counts down. True: more may come at once, so the planner may
/// go on hoping.
bool Machine::read_input(int& lines) {
    if (state_ == State::faulted) {
        // A job that arrives now is refused, not kept for later: nobody expects it to start after
        // the repair.
        const FixedString<236> fault = link_.status().fault;
        if (job_.take_arrival()) end_job({JobOutcome::failed, fault});
        return false;
    }
    bool more = true;
    const auto has_room = [this] {
        return pipe_.has_room() && places_.has_room() && !pipe_.stops().running();
    };
    const double enough_s = pipe_.planner().appended_s() + kReadAtOnce_s;
    const int last = std::max(0, lines - kLinesAtOnce);
    while (lines > last && more && reads() && has_room() && pipe_.planner().appended_s() < enough_s) {
        more = read_line();
        if (more) --lines;
    }
    return more && reads();
}

/// One line, from whoever has one. False: nothing to read now.
bool Machine::read_line() {
    if (actions_.has_rest()) {
        actions_.go_on();
        return true;
    }
    if (job_.interpreter().pending()) {
        proceed_pending();
        return true;
    }
    if (console_.waiting()) {
        if (!console_is_ready()) return false;
        run_typed_line();
        return true;
    }
    const Result<JobRun::Read> read = job_.read();
    heed_request();
    if (!read.ok()) {
        stop_job(JobOutcome::failed, read.error().message);
        return true;
    }
    if (*read == JobRun::Read::begun) {
        to(Event::begin);
        actions_.printed().forget();
        // A host may have been here, or a person.
        if (pipe_.drained() && !pipe_.stops().running()) pipe_.settle_filament();
        forget_settings();
    }
    return *read != JobRun::Read::nothing;
}

/// More of a curve, or of a macro.
void Machine::proceed_pending() {
    actions_.set_speaker(host_.in_hand() ? Speaker::host : Speaker::job);
    const Result<void> proceeded = job_.interpreter().proceed(kArcPiecesAtOnce);
    heed_request();
    if (!proceeded.ok()) {
        if (job_.running()) {
            stop_job(JobOutcome::failed, proceeded.error().message);
        } else {
            link_.say(ReplyKind::error, proceeded.error().message);
        }
    }
    actions_.set_speaker(Speaker::job);
}

/// The next typed line need not wait until lines are read. While a job runs or a fault is latched
/// what may be typed waits for nothing; while away it may be a jog, which needs room; otherwise
/// it may be a question, or a person's that does not move.
bool Machine::runs_at_once() {
    if (!job_.running() && state_ != State::faulted)
        return state_ == State::idle && console_.waits_for_nothing(reads());
    if (parking_.away()) return pipe_.has_room();
    return !job_.interpreter().pending() || !console_.waits_for_line();
}

/// A line is there, and no line of a host is in hand.
bool Machine::console_is_ready() {
    settle_host_line();
    return console_.waiting() && !host_.in_hand();
}

void Machine::settle_host_line() {
    // What may be said beside a job waits for nothing of the job's.
    const bool beside = job_.running();
    const bool done =
        !pending() && !heating_.wait().active() && !homing_.active() && !pipe_.stops().running();
    host_.settle(beside || done, beside || (done && pipe_.drained() && places_.all_passed()));
}

void Machine::run_typed_line() {
    gcode::Interpreter& of_job = job_.interpreter();
    gcode::Interpreter& interpreter = parking_.away() ? parking_.interpreter() : of_job;
    const Speaker speaker = console_.speaker();
    if (console_.host_begins()) {
        begin_host();
    } else if (speaker == Speaker::host) {
        host_.begin(console_.ok());
    }
    actions_.set_speaker(speaker);
    const FixedString<gcode::kCommandBytesMax> line{console_.line()};
    const std::uint32_t exclusions = of_job.exclusions();
    const double flow = of_job.state().flow_factor, left_mm = actions_.rest_print_mm();
    const std::optional<Result<void>> done =
        console_.run_next({state_ == State::faulted, job_.running(), parking_.rests()}, interpreter);
    if (parking_.away()) {
        of_job.adopt_factors(interpreter.state());
        of_job.adopt_exclusions(interpreter);
    }
    if (job_.running() && (of_job.exclusions() != exclusions || of_job.state().flow_factor != flow))
        job_.note_typed_object(line, left_mm);
    heed_request();
    if (done && !done->ok()) link_.say(ReplyKind::error, done->error().message);
    if (done && done->ok() && speaker == Speaker::person) link_.say(ReplyKind::text, "ok");
    if (speaker == Speaker::person && !job_.running()) base_.take();
    actions_.set_speaker(Speaker::job);
}

/// What the line just carried out has asked the machine for.
void Machine::heed_request() {
    const std::optional<Request> request = actions_.take_request();
    if (!request) return;
    if (const auto* pause = std::get_if<PauseAsked>(&*request)) {
        if (!job_.running()) return host_.hold();
        parking_.order(pause->order);
        return pause_job(true);
    }
    if (std::holds_alternative<EmergencyAsked>(*request)) return enter_fault("emergency stop (M112)");
    if (const auto* taken = std::get_if<HeatTaken>(&*request)) return pause_without_heat(*taken);
    switch (std::get<gcode::Report>(*request)) {
        case gcode::Report::temperatures:
            return link_.say(ReplyKind::text, temperatures(heating_.seen(), config_.has_bed));
        case gcode::Report::position:
            return link_.say(ReplyKind::text, position(position_shown(), pipe_));
        case gcode::Report::progress:
            return link_.say(ReplyKind::text, gcode::format_progress(job_.progress()));
        case gcode::Report::firmware:
            break;
        case gcode::Report::hot_end_gains:
        case gcode::Report::bed_gains:
        case gcode::Report::hot_end_model:
        case gcode::Report::bed_model:
        case gcode::Report::heat_settings:
            return report_heat(link_, heating_, config_, std::get<gcode::Report>(*request));
    }
    link_.say(ReplyKind::text, gcode::format_firmware({version(), config_.name, "", true, true}));
}

// ---- ends ---------------------------------------------------------------------------------------

/// Ends the job where its motion can come to rest; end_job() follows when it has (advance_hold).
void Machine::stop_job(JobOutcome outcome, std::string_view why) {
    if (!to(Event::stop)) return;
    job_.will_end({outcome, FixedString<236>{why}});
    actions_.forget_rest();
    heating_.forget_wait();
    heating_.all_off();
    host_.drop(console_.forget());
    if (!homing_.active()) return;
    homing_.abandon();
    homing_.tell(job_.interpreter());
    pipe_.stops().ask();
}

void Machine::end_job(const JobEnding& ending) {
    if (state_ != State::faulted) to(Event::end);
    job_.end(ending);
    if (ending.outcome == JobOutcome::failed) link_.say(ReplyKind::error, ending.why);
    if (ending.outcome != JobOutcome::completed || !actions_.printed().empty()) heating_.all_off();
    if (ending.outcome != JobOutcome::completed) {
        // What was read and will not be done, an M84 say, has changed nothing.
        homing_.tell(job_.interpreter());
    }
    parking_.forget();
    heating_.forget_wait();
    forget_settings();
}

/// Heat off, motion dropped, job failed; nothing moves until clear_fault.
void Machine::enter_fault(std::string_view why) {
    to(Event::fault);
    heating_.all_off();
    heating_.forget_wait();
    link_.status().fault.assign(why);
    host_.drop(console_.forget());
    parking_.forget();
    actions_.forget_rest();
    homing_.abandon();
    homing_.tell(job_.interpreter());
    pipe_.stops().ask();
    if (job_.running()) {
        end_job({JobOutcome::failed, FixedString<236>{why}});
    } else {
        link_.say(ReplyKind::error, why);
    }
}

/// For people: why nothing is laid down just now.
link::Activity Machine::activity() const {
    using enum link::Activity;
    if (homing_.active()) return homing_.probes() ? probing : homing;
    const bool waits = heating_.wait().active() && (state_ == State::printing || state_ == State::idle);
    if (parking_.heats() || (waits && places_.all_passed())) {
        const gcode::Heater heater = parking_.heats() ? heating_.coldest() : heating_.wait().heater();
        return heater == gcode::Heater::bed ? heating_bed : heating_hot_end;
    }
    return parking_.away() && state_ == State::printing ? returning : none;
}

/// Where the head is, by the steps that went out, as the program counts it. Only loop 2 knows that;
/// what the program has asked for is up to two seconds ahead.
gcode::Position Machine::position_shown() {
    const motion::AxisVector played = pipe_.played_mm();
    const double planned_mm = pipe_.planner().position_mm()[Axis::e] + actions_.rest_filament_mm();
    return parking_.shown(job_.interpreter())
        .programmed_position(to_position(played), Millimetres{planned_mm - played[Axis::e]});
}

void Machine::publish(Instant now) {
    const bool counts = state_ == State::printing || state_ == State::pausing || state_ == State::cancelling;
    job_.publish(now, counts, heating_.wait().active() && places_.all_passed());
    link::JobStatus& status = link_.status();
    status.state = state_;
    status.activity = activity();
    status.homed = {homing_.homed(Axis::x), homing_.homed(Axis::y), homing_.homed(Axis::z)};
    status.origin_steps = pipe_.scale().origin();
    status.position_mm = to_vector(position_shown());
    const bool paused = state_ == State::paused;
    status.parked = paused && parking_.has_parked();
    status.may_jog = (paused && parking_.rests()) || (state_ == State::idle && !job_.running() && reads());
    settle_host_line();
    status.host_lines = host_.over();
    status.fault_persists.assign(state_ == State::faulted ? heating_.persisting_fault() : std::string_view{});
    link_.publish();
}

}  // namespace qduino::printer::machine
