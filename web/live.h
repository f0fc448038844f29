// The live stream without its sockets: the messages of each subscriber, and which of them may be
// dropped.
//
// A slow reader must neither hold up the others nor fill the memory. So only the newest status
// waits for it, replies are bounded, and it is told what was dropped.
//
//     publisher (spool's thread) ──post──► LiveHub (I/O thread) ──► LiveQueue of each subscriber
//                                                               ──► its socket
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace qduino::web {

using Message = std::shared_ptr<const std::string>;

enum class MessageKind : std::uint8_t { status, jobs, upload, reply, history, alive };

/// The messages that wait for one subscriber.
class LiveQueue {
  public:
    static constexpr std::size_t kWaitingMax = 200;

    /// A newer status, list of jobs, upload progress or life sign replaces one that still waits.
    void push(MessageKind kind, Message message);
    /// The oldest; nothing when none waits.
    [[nodiscard]] std::optional<Message> pop();
    [[nodiscard]] std::size_t size() const { return waiting_.size(); }
    [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

  private:
    struct Entry {
        MessageKind kind;
        Message message;
    };
    std::deque<Entry> waiting_;
    std::uint64_t dropped_ = 0;
};

/// The last 600 s of temperatures, one sample a second.
class TemperatureHistory {
  public:
    static constexpr std::size_t kSamplesMax = 600;
    struct Sample {
        double t_s = 0;  ///< Unix time
        double hot_end_c = 0, hot_end_target_c = 0, bed_c = 0, bed_target_c = 0;
    };
    void add(const Sample& sample);
    /// {"type":"history",…}
    [[nodiscard]] std::string json() const;
    [[nodiscard]] std::size_t size() const { return samples_.size(); }

  private:
    std::deque<Sample> samples_;
};

/// The subscribers. I/O thread only.
class LiveHub {
  public:
    using Deliver = std::function<void(MessageKind, const Message&)>;
    static constexpr std::size_t kSubscribersMax = 64;

    /// Delivers the newest status, jobs and history at once, and then every message. Nothing when
    /// there are too many subscribers.
    [[nodiscard]] std::optional<std::uint64_t> subscribe(Deliver deliver);
    void unsubscribe(std::uint64_t id) { subscribers_.erase(id); }
    void publish(MessageKind kind, std::string message);
    void add(const TemperatureHistory::Sample& sample) { history_.add(sample); }

  private:
    std::map<std::uint64_t, Deliver> subscribers_;
    std::uint64_t next_id_ = 1;
    Message status_;
    Message jobs_;
    TemperatureHistory history_;
};

}  // namespace qduino::web
