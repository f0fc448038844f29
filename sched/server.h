// The server of one VCPU, of any kind: a sporadic or a deferrable server for a main VCPU, PIBS for
// an I/O VCPU.
//
// The simulator's scheduler (core_scheduler.h) and the account of a Linux thread (budget_account.h)
// ask the same questions of all kinds. They hold this type and never ask which kind it is, but for
// a report or a contract.
#pragma once

#include <span>
#include <variant>

#include "base/contract.h"
#include "base/time.h"
#include "sched/deferrable_server.h"
#include "sched/pibs.h"
#include "sched/sporadic_server.h"
#include "sched/vcpu.h"

namespace qduino::sched {

/// One owner at a time. No call blocks or allocates. `now` must not run backwards from call to
/// call.
class Server {
  public:
    /// For containers only: assign before use.
    Server() = default;
    Server(const SporadicServer& server) : server_(server) {}    // NOLINT: implicit by design
    Server(const DeferrableServer& server) : server_(server) {}  // NOLINT: implicit by design
    Server(const Pibs& server) : server_(server) {}              // NOLINT: implicit by design

    [[nodiscard]] bool is_io() const { return std::holds_alternative<Pibs>(server_); }
    [[nodiscard]] bool has_work() const {
        return std::visit([](const auto& server) { return !server.blocked(); }, server_);
    }
    /// The period that is its priority: a main VCPU's own, an I/O VCPU's client's. Contract: an I/O
    /// VCPU has work.
    [[nodiscard]] Nanoseconds rank_period() const {
        const auto* io = std::get_if<Pibs>(&server_);
        return io ? io->client_period() : parameters().period;
    }

    /// It has work from `now` on; no effect when it had some. An I/O VCPU works for its usual
    /// client.
    void wake(Instant now) {
        if (const auto* io = std::get_if<Pibs>(&server_)) return wake_for(now, io->usual_client());
        if (auto* main = std::get_if<SporadicServer>(&server_)) return main->unblock(now);
        std::get_if<DeferrableServer>(&server_)->unblock(now);
    }
    /// It has work for a main VCPU of period `client_period`, which may raise it. Contract:
    /// is_io().
    void wake_for(Instant now, Nanoseconds client_period) {
        QDUINO_EXPECT(is_io());
        std::get_if<Pibs>(&server_)->activate(now, client_period);
    }
    /// It has this budget and period from now on. Charge it first. Contract: is_io().
    void change(Instant now, VcpuParameters parameters) {
        QDUINO_EXPECT(is_io());
        std::get_if<Pibs>(&server_)->change(now, parameters);
    }
    /// A release of its loop was due at `nominal`. Tells a deferrable server where its period
    /// begins.
    void release(Instant nominal) {
        if (auto* main = std::get_if<DeferrableServer>(&server_)) main->release(nominal);
    }
    /// It has no work left. Charge what it used first.
    void block(Instant now) {
        std::visit([now](auto& server) { server.block(now); }, server_);
    }
    /// Charges `used` of CPU time that ended at `now_end`. Returns how much of it exceeded the
    /// budget, if it was used in one piece; that is charged forward. Contract: used >= 0.
    Nanoseconds consume(Instant now_end, Nanoseconds used) {
        return std::visit([&](auto& server) { return server.consume(now_end, used); }, server_);
    }

    /// CPU time that it may take from `now` on without a pause; 0 when throttled. Ask it while it
    /// has work.
    [[nodiscard]] Nanoseconds available(Instant now) const {
        return std::visit([now](const auto& server) { return server.available(now); }, server_);
    }
    /// The instant from which it may run: in the future exactly when it is throttled.
    [[nodiscard]] Instant next_replenishment() const {
        return std::visit([](const auto& server) { return server.next_replenishment(); }, server_);
    }
    /// Charged so far, ever.
    [[nodiscard]] Nanoseconds consumed() const {
        return std::visit([](const auto& server) { return server.consumed(); }, server_);
    }
    [[nodiscard]] const VcpuParameters& parameters() const {
        return *std::visit([](const auto& server) { return &server.parameters(); }, server_);
    }
    /// The refills of a sporadic server; none of another.
    [[nodiscard]] std::span<const Refill> refills() const {
        const auto* main = std::get_if<SporadicServer>(&server_);
        return main ? main->refills() : std::span<const Refill>{};
    }

  private:
    std::variant<SporadicServer, DeferrableServer, Pibs> server_;
};

}  // namespace qduino::sched
