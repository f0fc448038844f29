#include "spool/machine_link.h"

namespace qduino::spool {

using printer::link::Command;
using printer::link::LinkLayout;
using printer::link::ReplyKind;

// ---- emergency line -----------------------------------------------------------------------------

Result<void> EmergencyLine::stop() {
    return guarded([](LinkLayout* link) -> Result<void> {
        if (!link) return make_error(ErrorCode::unavailable, "no machine is connected");
        link->emergency.fetch_add(1, std::memory_order_release);
        return {};
    });
}

void EmergencyLine::attach(LinkLayout* link) {
    guarded([link](LinkLayout*& current) { return current = link; });
}

// ---- what the machine says ----------------------------------------------------------------------

void MachineLink::read(Instant now) {
    // Before the machine is read: if the link was replaced, the status read now is its last word.
    replaced_ = source_.is_replaced();
    LinkLayout* link = source_.current();
    view_ = link ? read_machine(*link) : MachineView{};
    if (!link) return;
    link->service_heartbeat.fetch_add(1, std::memory_order_relaxed);
    watch_heartbeat(now);
    watch_death(now);
    read_replies(*link);
}

void MachineLink::watch_heartbeat(Instant now) {
    if (view_.job.heartbeat != heartbeat_ || heartbeat_at_ == Instant{}) heartbeat_at_ = now;
    heartbeat_ = view_.job.heartbeat;
    view_.responding = now - heartbeat_at_ < kSilentAfter;
}

/// A sketch that was started anew has its explanation already, or never gets one.
void MachineLink::watch_death(Instant now) {
    if (view_.life == SketchLife::alive) return dead_since_.reset();
    if (!dead_since_) dead_since_ = now;
    view_.may_be_explained = !replaced_ && view_.death_note.empty() && now - *dead_since_ < kExplainedWithin;
}

void MachineLink::read_replies(LinkLayout& link) {
    // Bounded: a sketch that floods must not stop the tick.
    for (int frames = 0; frames < 256; ++frames) {
        const Result<std::optional<printer::link::FrameView>> frame = reply_reader_.read(link.replies);
        if (!frame.ok()) {
            log_.add(frame.error().message);
            continue;
        }
        if (!frame->has_value()) return;
        const Result<printer::link::ReplyText> reply = printer::link::decode_reply((*frame)->payload);
        if ((*frame)->type != printer::link::FrameType::reply || !reply.ok()) continue;
        auto& replies = reply->kind >= ReplyKind::host_text ? host_replies_ : replies_;
        if (replies.size() < kRepliesHeld) replies.push_back({reply->kind, std::string{reply->text}});
    }
}

void MachineLink::reopen() {
    source_.reopen();
    LinkLayout* link = source_.current();
    if (!link) return;
    // An earlier service may have written to these rings and read from them.
    link->jobs.adopt_writer();
    link->commands.adopt_writer();
    link->replies.adopt_reader();
    emergency_.attach(link);
    log_.add("connected to the machine");
}

std::string MachineLink::guarantee() {
    LinkLayout* link = source_.current();
    return link ? std::string{link->guarantee.read().json.view()} : std::string{};
}

// ---- what it is told ----------------------------------------------------------------------------

Result<void> MachineLink::check_connected() const {
    if (!view_.connected) return make_error(ErrorCode::unavailable, "no machine is connected");
    if (view_.life != SketchLife::alive) {
        return make_error(ErrorCode::unavailable, "the machine's program has died; start it anew");
    }
    if (!view_.responding) return make_error(ErrorCode::unavailable, "the machine does not answer");
    return {};
}

Result<void> MachineLink::push(Command command, std::string_view text) {
    LinkLayout* link = source_.current();
    if (!link ||
        !try_push(link->commands, printer::link::encode(printer::link::CommandText{command, text}))) {
        return make_error(ErrorCode::unavailable, "the machine takes no more commands now; try again");
    }
    return {};
}

Result<void> MachineLink::push_lines(std::span<const std::string> lines) {
    LinkLayout* link = source_.current();
    std::size_t needed = 0;
    for (const std::string& line : lines) {
        if (line.empty() || line.size() > 256 || line.find_first_of("\r\n") != std::string::npos) {
            return make_error(ErrorCode::invalid_argument, "a command is one line of 1 to 256 bytes");
        }
        needed += printer::link::kFrameHeaderBytes + 1 + line.size();
    }
    if (!link || link->commands.free() < needed) {
        return make_error(ErrorCode::unavailable, "the machine takes no more commands now; try again");
    }
    for (const std::string& line : lines) QDUINO_TRY(push(Command::gcode, line));
    return {};
}

Result<void> MachineLink::clear_fault() {
    QDUINO_TRY(check_connected());
    if (view_.job.state != printer::link::MachineState::faulted) {
        return make_error(ErrorCode::not_permitted, "the machine has no fault");
    }
    if (const auto persists = view_.job.fault_persists.view(); !persists.empty()) {
        return make_error(ErrorCode::not_permitted, "the fault is still there: ", persists);
    }
    return push(Command::clear_fault);
}

}  // namespace qduino::spool
