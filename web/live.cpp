#include "web/live.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "base/text.h"

namespace qduino::web {

void LiveQueue::push(MessageKind kind, Message message) {
    if (kind != MessageKind::reply) {
        const auto waiting = std::ranges::find(waiting_, kind, &Entry::kind);
        if (waiting != waiting_.end()) {
            waiting->message = std::move(message);
            return;
        }
    }
    if (waiting_.size() >= kWaitingMax) {
        ++dropped_;
        return;
    }
    waiting_.push_back({kind, std::move(message)});
}

std::optional<Message> LiveQueue::pop() {
    if (waiting_.empty()) return std::nullopt;
    Message message = std::move(waiting_.front().message);
    waiting_.pop_front();
    if (dropped_ > 0 && waiting_.size() < kWaitingMax / 2) {
        const auto words = text(dropped_, " lines were dropped: this connection is too slow");
        const nlohmann::json note{{"type", "reply"}, {"kind", "warning"}, {"text", words.view()}};
        waiting_.push_back({MessageKind::reply, std::make_shared<const std::string>(note.dump())});
        dropped_ = 0;
    }
    return message;
}

void TemperatureHistory::add(const Sample& sample) {
    samples_.push_back(sample);
    if (samples_.size() > kSamplesMax) samples_.pop_front();
}

std::string TemperatureHistory::json() const {
    nlohmann::ordered_json json{{"type", "history"}};
    const auto column = [&](const char* name, double Sample::*field) {
        auto& values = json[name] = nlohmann::ordered_json::array();
        for (const Sample& sample : samples_) values.push_back(sample.*field);
    };
    column("t_s", &Sample::t_s);
    column("hot_end_c", &Sample::hot_end_c);
    column("hot_end_target_c", &Sample::hot_end_target_c);
    column("bed_c", &Sample::bed_c);
    column("bed_target_c", &Sample::bed_target_c);
    return json.dump();
}

std::optional<std::uint64_t> LiveHub::subscribe(Deliver deliver) {
    if (subscribers_.size() >= kSubscribersMax) return std::nullopt;
    if (status_) deliver(MessageKind::status, status_);
    if (jobs_) deliver(MessageKind::jobs, jobs_);
    deliver(MessageKind::history, std::make_shared<const std::string>(history_.json()));
    subscribers_[next_id_] = std::move(deliver);
    return next_id_++;
}

void LiveHub::publish(MessageKind kind, std::string text) {
    const Message message = std::make_shared<const std::string>(std::move(text));
    if (kind == MessageKind::status) status_ = message;
    if (kind == MessageKind::jobs) jobs_ = message;
    for (const auto& [id, deliver] : subscribers_) deliver(kind, message);
}

}  // namespace qduino::web
