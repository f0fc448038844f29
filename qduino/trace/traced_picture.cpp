#include "qduino/trace/traced_picture.h"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/text.h"
#include "posix/small_file.h"
#include "report/picture/page.h"
#include "report/picture/picture_file.h"

namespace qduino::apps {
namespace {

using picture::Doing;

AdmittedLoop loop_of(const nlohmann::json& json) {
    AdmittedLoop loop;
    loop.id = json.at("id").get<sched::VcpuId>();
    loop.core = json.at("core").is_null() ? sched::kAnyCore : json.at("core").get<int>();
    loop.budget = Nanoseconds{json.at("budget_ns").get<std::int64_t>()};
    loop.period = Nanoseconds{json.at("period_ns").get<std::int64_t>()};
    if (loop.id > sched::kMainVcpuLimit) {
        loop.kind = sched::VcpuKind::io;
    } else if (!json.at("response_ns").is_null()) {
        loop.response = Nanoseconds{json.at("response_ns").get<std::int64_t>()};
    }
    return loop;
}

picture::Recorder recorder_for(const std::vector<AdmittedLoop>& loops, const TracedWindow& window) {
    const std::vector<sched::Vcpu> vcpus(loops.begin(), loops.end());
    const Instant from = kEpoch + from_seconds(window.from_s);
    const Nanoseconds length = window.length_s ? from_seconds(*window.length_s) : picture::good_length(vcpus);
    return {from, from + std::max(length, Nanoseconds{1})};
}

/// A loop that has its core for itself (runtime/plan.h).
bool owns_core(const AdmittedLoop& loop, const std::vector<AdmittedLoop>& all) {
    return loop.budget == loop.period &&
           std::ranges::count(all, loop.core, [](const AdmittedLoop& other) { return other.core; }) == 1;
}

}  // namespace

std::vector<AdmittedLoop> admitted_loops(const std::string& path) {
    const Result<std::string> text = posix::read_small_file(path);
    if (!text) return {};
    std::vector<AdmittedLoop> loops;
    try {
        const nlohmann::json report = nlohmann::json::parse(*text);
        for (const char* kind : {"loops", "io"}) {
            for (const nlohmann::json& loop : report.at(kind)) loops.push_back(loop_of(loop));
        }
    } catch (const nlohmann::json::exception&) {
        return {};
    }
    std::erase_if(loops, [](const AdmittedLoop& loop) { return loop.core < 0; });
    return loops;
}

TracedPicture::TracedPicture(std::string sketch, std::vector<AdmittedLoop> loops, const TracedWindow& window)
    : sketch_(std::move(sketch)),
      loops_(std::move(loops)),
      recorder_(recorder_for(loops_, window)),
      may_choose_(!window.length_s) {
    for (const AdmittedLoop& loop : loops_) recorder_.declare(loop, owns_core(loop, loops_));
}

Instant TracedPicture::at(std::int64_t us) {
    if (!start_us_) start_us_ = us;
    last_ = std::max(last_, kEpoch + Nanoseconds{1000 * (us - *start_us_)});
    return last_;
}

void TracedPicture::does(int core, sched::VcpuId vcpu, Doing doing, std::int64_t us) {
    if (!start_us_ && doing != Doing::runs) return;
    recorder_.does(core, vcpu, doing, at(us));
}

void TracedPicture::woke(int core, sched::VcpuId vcpu, std::int64_t us, bool throttled) {
    if (!start_us_) return;
    const Instant now = at(us);
    // A wake-up may be told of a thread that runs: it was about to sleep, and did not.
    if (recorder_.doing(vcpu) != Doing::runs) recorder_.does(core, vcpu, Doing::waits, now);
    if (!throttled) recorder_.released(core, vcpu, now, std::nullopt);
}

void TracedPicture::taken(int core, std::int64_t from_us, std::int64_t until_us, const std::string& what) {
    if (!start_us_ || from_us < *start_us_) return;
    recorder_.taken(core, kEpoch + Nanoseconds{1000 * (from_us - *start_us_)}, at(until_us), what);
}

picture::Schedule TracedPicture::finish() {
    picture::Schedule schedule = recorder_.finish(last_);
    std::erase_if(schedule.cores, [](const picture::Core& core) { return core.rows.empty(); });
    schedule.title = sketch_ + " on this computer";
    schedule.remark =
        "As the kernel's tracer saw it, from the first stretch of a loop on, to the microsecond. An arrow is "
        "a wake-up: "
        "the kernel does not know releases and deadlines. R is what admission counted with.";
    for (const AdmittedLoop& loop : loops_) {
        if (loop.is_io()) continue;
        schedule.responses.push_back({.name = picture::row_name(loop.id),
                                      .budget = loop.budget,
                                      .period = loop.period,
                                      .worst = loop.response,
                                      .seen = {}});
    }
    return schedule;
}

Result<void> TracedPicture::write(const std::string& path, const PinWitness* pins) {
    if (!start_us_)
        return make_error(ErrorCode::not_found,
                          "there is nothing to draw: the kernel saw no loop run. Not written: ", path);
    picture::Schedule schedule = finish();
    if (pins) pins->add_rows(schedule, instant_from_ns(1000 * *start_us_), may_choose_);
    QDUINO_TRY(picture::write_picture(path, picture::svg_page(schedule)));
    std::fputs(text<std::string>("picture: ", path, '\n').c_str(), stderr);
    return {};
}

}  // namespace qduino::apps
