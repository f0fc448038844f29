// The spool's end of the link: what the machine says, and what it is told beside a job's bytes.
//
// On the spool's thread, which may block on the disk. EmergencyLine is the one exception, and
// thread-safe.
#pragma once

#include <atomic>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "printer/link/frame.h"
#include "spool/ledger.h"
#include "spool/link_source.h"
#include "spool/machine_view.h"
#include "spool/run.h"

namespace qduino::spool {

/// Text from the machine.
struct Reply {
    printer::link::ReplyKind kind = printer::link::ReplyKind::text;
    std::string text;
};

/// Takes an emergency stop to the machine: one atomic, never behind a disk. Any thread.
class EmergencyLine {
  public:
    /// Error: unavailable, when no machine is connected.
    [[nodiscard]] Result<void> stop();

  private:
    friend class MachineLink;
    void attach(printer::link::LinkLayout* link);
    /// Calls `with_link` while the link stays: for one store, or for one swap of the pointer. So
    /// whoever comes meanwhile waits without sleeping.
    template <typename Function>
    auto guarded(Function with_link) {
        while (held_.test_and_set(std::memory_order_acquire)) {
        }
        const auto done = with_link(link_);
        held_.clear(std::memory_order_release);
        return done;
    }
    std::atomic_flag held_;
    printer::link::LinkLayout* link_ = nullptr;
};

class MachineLink {
  public:
    static constexpr std::size_t kRepliesHeld = 1000;
    /// A sketch whose heartbeat stands still for this long is given nothing. Only its supervisor
    /// may call it dead.
    static constexpr Nanoseconds kSilentAfter = std::chrono::seconds{3};
    /// The job of a dead sketch fails without its supervisor's reason when that has not come after
    /// this long.
    static constexpr Nanoseconds kExplainedWithin = std::chrono::seconds{1};

    /// Both outlive this.
    MachineLink(LinkSource& source, LogLines& log) : source_(source), log_(log) {}
    ~MachineLink() { detach(); }
    MachineLink(const MachineLink&) = delete;
    MachineLink& operator=(const MachineLink&) = delete;

    /// Once each tick: what the machine says now.
    void read(Instant now);
    /// The link that was read then is not the newest one any more: its sketch is gone, and what was
    /// read is its last word.
    [[nodiscard]] bool is_replaced() const { return replaced_; }
    void detach() { emergency_.attach(nullptr); }
    /// Goes over to the newest link.
    void reopen();

    /// The machine at the last read().
    [[nodiscard]] const MachineView& view() const { return view_; }
    /// Null: there is none.
    [[nodiscard]] printer::link::LinkLayout* layout() { return source_.current(); }
    /// What the machine says of its job is said of `run`.
    [[nodiscard]] bool speaks_of(const Run& run) const {
        return view_.connected && view_.session == run.session && view_.job.job_id == run.id;
    }
    [[nodiscard]] EmergencyLine& emergency() { return emergency_; }
    /// The replies since the last call, oldest first; at most kRepliesHeld.
    [[nodiscard]] std::vector<Reply> take_replies() { return std::exchange(replies_, {}); }
    [[nodiscard]] std::vector<Reply> take_host_replies() { return std::exchange(host_replies_, {}); }
    /// As the sketch wrote it; empty when not connected.
    [[nodiscard]] std::string guarantee();

    // Errors: unavailable (not connected, or its ring is full).
    [[nodiscard]] Result<void> check_connected() const;
    [[nodiscard]] Result<void> push(printer::link::Command command, std::string_view text = {});
    /// All lines or none, in order. Error: also invalid_argument (too long, or no single line).
    [[nodiscard]] Result<void> push_lines(std::span<const std::string> lines);
    /// Error: also not_permitted (no fault, or it is still there).
    [[nodiscard]] Result<void> clear_fault();

  private:
    void watch_heartbeat(Instant now);
    void watch_death(Instant now);
    void read_replies(printer::link::LinkLayout& link);

    LinkSource& source_;
    LogLines& log_;
    MachineView view_;
    bool replaced_ = false;
    EmergencyLine emergency_;
    printer::link::FrameReader reply_reader_;
    std::vector<Reply> replies_;
    std::vector<Reply> host_replies_;
    std::uint64_t heartbeat_ = 0;
    Instant heartbeat_at_{};             // when it last changed
    std::optional<Instant> dead_since_;  // as this service saw it
};

}  // namespace qduino::spool
