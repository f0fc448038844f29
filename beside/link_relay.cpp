#include "beside/link_relay.h"

#include <algorithm>
#include <array>
#include <ctime>
#include <string_view>

namespace qduino::apps::beside_linux {
namespace {

using printer::link::LinkLayout;

/// What fits, in order.
template <typename Ring>
void carry(Ring& from, Ring& to) {
    std::array<std::uint8_t, 4096> bytes;
    while (const std::size_t room = std::min(bytes.size(), to.free())) {
        const std::size_t count = from.pop_some({bytes.data(), room});
        if (count == 0) return;
        to.push_some({bytes.data(), count});
    }
}

}  // namespace

LinkRelay::~LinkRelay() {
    if (!file_) return;
    constexpr std::string_view kNote = "its run beside Linux has ended";
    LinkLayout& link = *file_.get();
    static_assert(kNote.size() < sizeof link.death_note);
    std::ranges::copy(kNote, link.death_note.begin());
    link.death_note_ready.store(1, std::memory_order_release);
    link.sketch_dead.store(1, std::memory_order_release);
}

Result<void> LinkRelay::pass(Instant now) {
    if (path_.empty() || board_.magic.load(std::memory_order_acquire) != printer::link::kMagic) return {};
    if (!file_) {
        if (board_.version != printer::link::kVersion || board_.size != sizeof(LinkLayout))
            return make_error(ErrorCode::unsupported,
                              "the image's link is of another version: build both anew");
        QDUINO_TRY_ASSIGN(file_, create_link(path_, static_cast<std::uint64_t>(std::time(nullptr))));
    }
    to_board();
    to_service();
    if (now < next_status_) return {};
    constexpr Nanoseconds kStatusEvery = 10ms;
    next_status_ = now + kStatusEvery;
    tell_status();
    return {};
}

/// The stop goes first: no byte of a job delays it.
void LinkRelay::to_board() {
    LinkLayout& service = *file_.get();
    board_.emergency.store(service.emergency.load(std::memory_order_acquire), std::memory_order_release);
    board_.service_pid.store(service.service_pid.load(std::memory_order_relaxed), std::memory_order_relaxed);
    board_.service_heartbeat.store(service.service_heartbeat.load(std::memory_order_relaxed),
                                   std::memory_order_relaxed);
    carry(service.commands, board_.commands);
    carry(service.jobs, board_.jobs);
}

void LinkRelay::to_service() {
    LinkLayout& service = *file_.get();
    carry(board_.replies, service.replies);
    service.step_cost_ns.store(board_.step_cost_ns.load(std::memory_order_relaxed),
                               std::memory_order_relaxed);
}

void LinkRelay::tell_status() {
    LinkLayout& service = *file_.get();
    service.motion_status.write(board_.motion_status.read());
    service.heat_status.write(board_.heat_status.read());
    service.job_status.write(board_.job_status.read());
    // The beds are written before the heaters' numbers, and read behind them: they are no older.
    const printer::link::KeptHeat heat = board_.kept_heat.read();
    service.kept_beds.write(board_.kept_beds.read());
    service.kept_heat.write(heat);
}

}  // namespace qduino::apps::beside_linux
