// The sketch's end of the link: commands in, words and the status out.
//
// Each part of the machine writes its share of the status here. It is handed over whole, once per
// release. Loop 1 only.
#pragma once

#include <optional>

#include "printer/link/frame.h"
#include "printer/link/layout.h"
#include "printer/machine/job_receiver.h"

namespace qduino::printer::machine {

class LinkEnd {
  public:
    static constexpr int kCommandsPerRelease = 192;  ///< more than a host sends ahead

    /// `layout` must outlive this.
    explicit LinkEnd(link::LinkLayout& layout) : layout_(layout) {}

    [[nodiscard]] JobReceiver::Ring& jobs() { return layout_.jobs; }

    /// Hands the service's commands to `serve(const link::CommandText&)`, in order; at most
    /// kCommandsPerRelease frames. A damaged one is answered.
    template <typename Serve>
    void take_commands(Serve&& serve) {
        for (int i = 0; i < kCommandsPerRelease; ++i) {
            const Result<std::optional<link::FrameView>> frame = commands_.read(layout_.commands);
            if (!frame.ok()) {
                say(link::ReplyKind::error, frame.error().message);
                continue;
            }
            if (!frame->has_value()) return;
            if ((*frame)->type != link::FrameType::command) continue;
            const Result<link::CommandText> command = link::decode_command((*frame)->payload);
            if (!command.ok()) say(link::ReplyKind::error, command.error().message);
            if (command.ok()) serve(*command);
        }
    }

    /// From here on, whether say() answers the line of a serial host.
    void answer_host(bool answers) { to_host_ = answers; }
    /// To the console. Dropped when the service does not read, and counted.
    void say(link::ReplyKind kind, std::string_view text) {
        if (to_host_) kind = host_kind(kind);
        if (!link::try_push(layout_.replies, link::encode(link::ReplyText{kind, text}))) ++replies_dropped_;
    }

    /// M500: the service keeps these numbers.
    void keep(const link::KeptHeat& heat, const KeptBeds& beds) {
        layout_.kept_beds.write(beds);
        layout_.kept_heat.write(heat);
    }

    /// The status of the running or last job, and of the machine.
    [[nodiscard]] link::JobStatus& status() { return status_; }
    [[nodiscard]] const link::JobStatus& status() const { return status_; }
    [[nodiscard]] bool job_running() const { return status_.outcome == link::JobOutcome::running; }

    /// Hands the status over; counts the heartbeat.
    void publish() {
        status_.heartbeat = ++releases_;
        status_.replies_dropped = replies_dropped_;
        layout_.job_status.write(status_);
    }

  private:
    static link::ReplyKind host_kind(link::ReplyKind kind) {
        constexpr int kOffset =
            static_cast<int>(link::ReplyKind::host_text) - static_cast<int>(link::ReplyKind::text);
        return static_cast<link::ReplyKind>(static_cast<int>(kind) + kOffset);
    }

    link::LinkLayout& layout_;
    link::FrameReader commands_;
    link::JobStatus status_;
    std::uint64_t releases_ = 0;
    std::uint64_t replies_dropped_ = 0;
    bool to_host_ = false;
};

}  // namespace qduino::printer::machine
