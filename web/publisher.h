// The periodic work of the spool's thread: ticks the spool, and tells the live stream and the log
// what changed.
#pragma once

#include <functional>
#include <string>

#include "spool/spool.h"
#include "web/service.h"

namespace qduino::web {

class Publisher {
  public:
    static constexpr Nanoseconds kTickEvery = std::chrono::milliseconds{20};
    static constexpr Nanoseconds kStatusEvery = std::chrono::milliseconds{100};
    static constexpr Nanoseconds kSampleEvery = std::chrono::seconds{1};
    static constexpr Nanoseconds kAliveEvery = std::chrono::seconds{1};

    /// `log` is called on the spool's thread. All outlive the publisher.
    Publisher(spool::Spool& spool, Service& service, Executor io,
              std::function<void(const std::string&)> log);

    /// Spool's thread, every kTickEvery.
    void tick(Moment moment);

  private:
    void publish(MessageKind kind, std::string message);
    void publish_replies();
    void publish_sample(Moment moment);
    void publish_alive(Moment moment);

    spool::Spool& spool_;
    Service& service_;
    Executor io_;
    std::function<void(const std::string&)> log_;
    Instant status_at_{};
    Instant sample_at_{};
    Instant alive_at_{};
    std::uint64_t published_revision_ = 0;
    /// The words for the jobs' states: a pause changes them without a revision.
    std::string published_words_;
};

}  // namespace qduino::web
