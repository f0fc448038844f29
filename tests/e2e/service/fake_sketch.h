// A stand-in for the sketch on the other end of the link: follows the receiver's rules of frame.h
// and prints nothing.
//
// It reports every job byte that it takes, once, to its log: the proof that the bytes that crossed
// are the bytes that were uploaded. Pure except for the layout that it works on. The caller decides
// when it steps and how much it may take.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "printer/link/frame.h"

namespace qduino::tests {

class FakeSketch {
  public:
    /// What the sketch did, in order. `bytes` of a job come without gaps from offset 0.
    struct Log {
        std::function<void(std::uint64_t job, std::uint64_t length)> begun;
        std::function<void(std::uint64_t job, std::span<const std::uint8_t> bytes)> taken;
        std::function<void(std::uint64_t job, printer::link::JobOutcome outcome)> ended;
        std::function<void(const std::string& line)> gcode;
    };

    FakeSketch(printer::link::LinkLayout& link, Log log) : link_(link), log_(std::move(log)) {
        served_emergencies_ = link_.emergency.load();
        status_.state = printer::link::MachineState::idle;
        status_.homed.fill(true);
        status_.position_mm = {75, 75, 10, 0};
        heat_.hot_end.reading = heat_.bed.reading = true;
        heat_.idle_timeout_s = 600;
        publish();
    }

    /// One release: commands, then at most `bytes_max` job bytes (whole frames), then the status.
    void step(std::size_t bytes_max) {
        using printer::link::MachineState;
        ++status_.heartbeat;
        serve_emergency();
        read_commands();
        std::size_t taken = 0;
        while (taken < bytes_max && status_.state != MachineState::paused) {
            const auto frame = reader_.read(link_.jobs);
            if (!frame.ok()) continue;
            if (!frame->has_value()) break;
            taken += take(**frame);
        }
        heat();
        publish();
    }

    /// The machine breaks: the running job fails.
    void fault(std::string_view why) {
        status_.fault = why;
        status_.state = printer::link::MachineState::faulted;
        if (running()) end(printer::link::JobOutcome::failed);
        publish();
    }

    /// What the next publish() says of the machine.
    [[nodiscard]] printer::link::JobStatus& status() { return status_; }
    [[nodiscard]] printer::link::HeatStatus& heat_status() { return heat_; }
    /// What the machine says of where it is in the job. It reads no G-code, and would not know.
    void stand_at(std::uint64_t line, std::uint32_t layer) {
        status_.line = line;
        status_.layer = layer;
        publish();
    }

    [[nodiscard]] std::uint64_t corrupt_count() const { return reader_.corrupt_count(); }

  private:
    [[nodiscard]] bool running() const { return status_.outcome == printer::link::JobOutcome::running; }

    void end(printer::link::JobOutcome outcome) {
        status_.outcome = outcome;
        if (status_.state != printer::link::MachineState::faulted) {
            status_.state = printer::link::MachineState::idle;
        }
        if (log_.ended) log_.ended(status_.job_id, outcome);
    }

    void serve_emergency() {
        const std::uint32_t asked = link_.emergency.load(std::memory_order_acquire);
        if (asked == served_emergencies_) return;
        served_emergencies_ = asked;
        fault("emergency stop");
    }

    void read_commands() {
        while (true) {
            const auto frame = command_reader_.read(link_.commands);
            if (!frame.ok()) continue;
            if (!frame->has_value()) return;
            const auto command = printer::link::decode_command((*frame)->payload);
            if ((*frame)->type == printer::link::FrameType::command && command.ok()) obey(*command);
        }
    }

    void obey(const printer::link::CommandText& command) {
        using printer::link::Command;
        using printer::link::MachineState;
        switch (command.command) {
            case Command::pause:
                if (status_.state == MachineState::printing) status_.state = MachineState::paused;
                return;
            case Command::resume:
                if (status_.state == MachineState::paused) status_.state = MachineState::printing;
                return;
            case Command::cancel:
                if (running()) end(printer::link::JobOutcome::cancelled);
                return;
            case Command::clear_fault:
                if (!status_.fault_persists.empty()) return;
                if (status_.state == MachineState::faulted) status_.state = MachineState::idle;
                status_.fault.clear();
                return;
            case Command::gcode:
                if (log_.gcode) log_.gcode(std::string{command.text});
                if (command.text.starts_with("M104 S"))
                    hot_target_ = std::stod(std::string{command.text.substr(6)});
                reply("ok");
                return;
            case Command::host_line:
                if (!command.text.empty()) ++status_.host_lines;
                return;
        }
    }

    void reply(std::string_view text) {
        const auto frame =
            printer::link::encode(printer::link::ReplyText{printer::link::ReplyKind::text, text});
        if (!try_push(link_.replies, frame)) ++status_.replies_dropped;
    }

    /// Job bytes taken from this frame.
    std::size_t take(const printer::link::FrameView& frame) {
        using printer::link::FrameType;
        switch (frame.type) {
            case FrameType::job_begin:
                begin(frame.payload);
                return 0;
            case FrameType::job_bytes:
                return take_bytes(frame.payload);
            case FrameType::job_end:
                finish(frame.payload);
                return 0;
            case FrameType::command:
            case FrameType::reply:
                return 0;
        }
        return 0;
    }

    void begin(std::span<const std::uint8_t> payload) {
        const auto begin = printer::link::decode_job_begin(payload);
        if (!begin.ok() || begin->job_id <= status_.job_id || running()) return;
        status_.job_id = begin->job_id;
        status_.job_length = begin->length;
        status_.line = status_.layer = 0;
        status_.bytes_accepted = status_.bytes_planned = status_.bytes_executed = 0;
        status_.outcome = printer::link::JobOutcome::running;
        if (log_.begun) log_.begun(begin->job_id, begin->length);
        // A job that arrives while the machine is faulted is refused, not kept for later: as the
        // sketch does it.
        if (status_.state == printer::link::MachineState::faulted)
            return end(printer::link::JobOutcome::failed);
        status_.state = printer::link::MachineState::printing;
    }

    std::size_t take_bytes(std::span<const std::uint8_t> payload) {
        const auto bytes = printer::link::decode_job_bytes(payload);
        if (!bytes.ok() || !running() || bytes->job_id != status_.job_id) return 0;
        const std::uint64_t held = status_.bytes_accepted;
        const std::uint64_t end = bytes->offset + bytes->bytes.size();
        if (bytes->offset > held || end <= held || end > status_.job_length) return 0;
        const auto fresh = bytes->bytes.subspan(static_cast<std::size_t>(held - bytes->offset));
        if (log_.taken) log_.taken(status_.job_id, fresh);
        status_.bytes_accepted = status_.bytes_planned = status_.bytes_executed = end;
        return fresh.size();
    }

    void finish(std::span<const std::uint8_t> payload) {
        const auto finished = printer::link::decode_job_end(payload);
        if (!finished.ok() || !running() || finished->job_id != status_.job_id) return;
        if (status_.bytes_accepted == status_.job_length) end(printer::link::JobOutcome::completed);
    }

    void heat() {
        heat_.heartbeat = status_.heartbeat;
        heat_.hot_end.target_celsius = hot_target_;
        heat_.hot_end.celsius += (std::max(hot_target_, 21.0) - heat_.hot_end.celsius) * 0.2;
        heat_.bed.celsius = 21;
    }

    void publish() {
        using printer::link::MachineState;
        status_.parked = status_.state == MachineState::paused;
        status_.may_jog = status_.state == MachineState::paused || status_.state == MachineState::idle;
        link_.job_status.write(status_);
        link_.heat_status.write(heat_);
        motion_.heartbeat = status_.heartbeat;
        link_.motion_status.write(motion_);
    }

    printer::link::LinkLayout& link_;
    Log log_;
    printer::link::FrameReader reader_;
    printer::link::FrameReader command_reader_;
    printer::link::JobStatus status_;
    printer::link::HeatStatus heat_;
    printer::link::MotionStatus motion_;
    double hot_target_ = 0;
    std::uint32_t served_emergencies_ = 0;
};

}  // namespace qduino::tests
