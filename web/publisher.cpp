#include "web/publisher.h"

#include <limits>

#include "base/words.h"
#include "web/api/json.h"

namespace qduino::web {

using api::Json;

namespace {

using printer::link::ReplyKind;
constexpr Words<ReplyKind::text, ReplyKind::error> kReplies{"text", "warning", "error"};

}  // namespace

Publisher::Publisher(spool::Spool& spool, Service& service, Executor io,
                     std::function<void(const std::string&)> log)
    : spool_(spool), service_(service), io_(std::move(io)), log_(std::move(log)) {}

void Publisher::publish(MessageKind kind, std::string message) {
    io_([this, kind, message = std::move(message)]() mutable {
        service_.live().publish(kind, std::move(message));
    });
}

void Publisher::tick(Moment moment) {
    spool_.tick(moment.now, moment.now_s);
    for (const std::string& line : spool_.take_log()) log_(line);
    publish_replies();
    if (moment.now - status_at_ >= kStatusEvery) {
        status_at_ = moment.now;
        publish(MessageKind::status,
                api::text_of({{"type", "status"}, {"status", api::status_json(spool_)}}));
        const spool::Job* printing = spool_.queue().printing();
        const std::string words{printing ? api::job_word(spool_, *printing) : ""};
        if (spool_.revision() != published_revision_ || words != published_words_) {
            published_revision_ = spool_.revision();
            published_words_ = words;
            Json message{{"type", "jobs"}};
            message.update(api::jobs_json(spool_));
            publish(MessageKind::jobs, api::text_of(message));
        }
    }
    if (moment.now - sample_at_ >= kSampleEvery) publish_sample(moment);
    if (moment.now - alive_at_ >= kAliveEvery) publish_alive(moment);
}

void Publisher::publish_replies() {
    for (const spool::Reply& reply : spool_.take_replies()) {
        publish(MessageKind::reply,
                api::text_of({{"type", "reply"}, {"kind", kReplies(reply.kind)}, {"text", reply.text}}));
    }
}

/// It comes from the spool's thread: when that thread stands still, what the page shows is old.
void Publisher::publish_alive(Moment moment) {
    alive_at_ = moment.now;
    publish(MessageKind::alive, api::text_of({{"type", "alive"}, {"time", api::time_json(moment.now_s)}}));
}

void Publisher::publish_sample(Moment moment) {
    sample_at_ = moment.now;
    const spool::MachineView& machine = spool_.machine();
    if (!machine.connected) return;
    const auto& heat = machine.heat;
    // A value that is no number is written as null: a gap in the curve.
    const auto celsius = [](const auto& heater) {
        return heater.reading ? heater.celsius : std::numeric_limits<double>::quiet_NaN();
    };
    const TemperatureHistory::Sample sample{static_cast<double>(moment.now_s), celsius(heat.hot_end),
                                            heat.hot_end.target_celsius, celsius(heat.bed),
                                            heat.bed.target_celsius};
    io_([this, sample] { service_.live().add(sample); });
}

}  // namespace qduino::web
