#include "printer/machine/job_run.h"

#include <algorithm>

namespace qduino::printer::machine {

using link::JobOutcome;

void JobRun::begin() {
    parser_.reset();
    interpreter_.reset_modes();
    places_.layers() = {};
    read_to_end_ = finished_ = false;
    last_line_ = 0;
    link_.status() = {};
    link_.status().outcome = JobOutcome::running;
    link_.status().job_id = receiver_.job_id();
    link_.status().job_length = receiver_.length();
}

bool JobRun::take_arrival() {
    if (receiver_.receive(link_.jobs()) != JobReceiver::Event::begun) return false;
    begin();
    return true;
}

Result<JobRun::Read> JobRun::read() {
    if (finished_) return Read::nothing;
    if (read_to_end_) {
        finished_ = true;
        QDUINO_TRY(interpreter_.finish());
        return Read::some;
    }
    const gcode::Line* line = nullptr;
    switch (receiver_.receive(link_.jobs())) {
        case JobReceiver::Event::none:
            return Read::nothing;
        case JobReceiver::Event::begun:
            begin();
            return Read::begun;
        case JobReceiver::Event::ended:
            read_to_end_ = true;
            line = parser_.finish();
            break;
        case JobReceiver::Event::bytes: {
            std::span<const char> bytes = gcode::as_chars(receiver_.held());
            const std::size_t before = bytes.size();
            line = parser_.next(bytes);
            receiver_.use(before - bytes.size());
            break;
        }
    }
    if (line == nullptr) return Read::some;
    QDUINO_TRY(carry_out(*line));
    return Read::some;
}

Result<void> JobRun::carry_out(const gcode::Line& line) {
    if (interpreter_.program_ended()) return {};
    QDUINO_TRY(interpreter_.heed(line));
    if (!line.comment.empty()) {
        const gcode::Annotation annotation = gcode::parse_annotation(line.comment);
        // It is shown when its first extrusion has been made.
        places_.layers().on_annotation(annotation);
    }
    if (line.error) return *line.error;
    if (line.command != nullptr) last_line_ = line.source.line;
    return line.command == nullptr ? Result<void>{} : interpreter_.execute(*line.command, kArcPiecesAtOnce);
}

gcode::PrintProgress JobRun::progress() const {
    const auto estimated_s = static_cast<double>(receiver_.estimated_s());
    if (!running() || estimated_s <= 0) return {};
    const double passed_s = link_.status().print_time_s;
    return {Seconds{passed_s}, Seconds{std::max(0.0, estimated_s - passed_s)}};
}

void JobRun::note_typed_object(std::string_view line, double left_mm) {
    static_assert(decltype(link::TypedObject::text)::kCapacity >= gcode::kCommandBytesMax);
    link::JobStatus& status = link_.status();
    status.typed_object[status.typed_objects % link::kTypedObjects] = {last_line_, left_mm, line};
    ++status.typed_objects;
}

void JobRun::end(const JobEnding& ending) {
    if (running()) {
        link_.status().outcome = ending.outcome;
        link_.status().bytes_accepted = receiver_.accepted();
        if (ending.outcome != JobOutcome::completed) link_.status().fault = ending.why;
        receiver_.close();
    }
    if (ending.outcome != JobOutcome::completed) interpreter_.reset_modes();
    read_to_end_ = finished_ = false;
}

void JobRun::publish(Instant now, bool counts, bool waits_for_heat) {
    link::JobStatus& status = link_.status();
    if (counts && running() && published_) {
        const double passed_s = to_seconds(now - *published_);
        status.print_time_s += passed_s;
        if (waits_for_heat) status.heating_time_s += passed_s;
    }
    published_ = now;
    if (running()) {
        status.bytes_accepted = receiver_.accepted();
        status.bytes_planned = parser_.offset();
    }
    status.unknown_codes = interpreter_.unknown_codes();
    status.warnings = interpreter_.warnings();
}

}  // namespace qduino::printer::machine
