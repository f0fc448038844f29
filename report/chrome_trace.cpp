#include "report/chrome_trace.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include "base/words.h"
#include "report/chrome_event.h"
#include "runtime/plan.h"

namespace qduino::apps {

using board::sim::TraceEvent;
using board::sim::TraceKind;

namespace {

/// Microseconds, as text: a double would lose nanoseconds after some months.
std::string microseconds(std::int64_t ns) {
    return text<std::string>(ns / 1000, '.', std::to_string(1000 + ns % 1000).substr(1));
}

constexpr Words<TraceKind::release, TraceKind::finish> kKinds{
    "release", "run", "preempt", "block", "throttle", "replenish", "overrun", "interrupt", "finish"};

}  // namespace

Result<std::unique_ptr<ChromeTrace>> ChromeTrace::create(const std::string& path) {
    std::FILE* file = std::fopen(path.c_str(), "w");
    if (!file) {
        const int why = errno;
        return make_error(why == EACCES ? ErrorCode::not_permitted : ErrorCode::unavailable, path, ": ",
                          std::strerror(why));
    }
    std::fputs("[\n", file);
    return std::unique_ptr<ChromeTrace>(new ChromeTrace(file));
}

ChromeTrace::~ChromeTrace() {
    if (file_) std::fclose(file_);
}

void ChromeTrace::add(const std::string& record) {
    std::fputs((std::exchange(first_, false) ? record : ",\n" + record).c_str(), file_);
}

void ChromeTrace::name_thread(const TraceEvent& event) {
    const bool interrupt = event.kind == TraceKind::interrupt;
    const int thread = interrupt ? chrome::kInterruptThread : event.vcpu;
    if (!named_.emplace(event.core, thread).second) return;
    add(chrome::thread_name(event.core, thread, interrupt ? "interrupts" : runtime::vcpu_name(event.vcpu)));
    add(chrome::core_name(event.core));
}

void ChromeTrace::end_stretch(int core, Instant now) {
    Running& running = running_[static_cast<std::size_t>(core)];
    if (running.vcpu == board::kNoVcpu) return;
    add(chrome::stretch(runtime::vcpu_name(running.vcpu), core, running.vcpu,
                        microseconds(to_ns(running.since)), microseconds(to_ns(now - running.since))));
    running.vcpu = board::kNoVcpu;
}

void ChromeTrace::on_event(const TraceEvent& event) {
    if (!file_) return;
    name_thread(event);
    Running& running = running_[event.core];
    if (event.kind == TraceKind::run) {
        end_stretch(event.core, event.time);
        running = {event.vcpu, event.time};
        return;
    }
    const bool leaves = event.kind == TraceKind::preempt || event.kind == TraceKind::block ||
                        event.kind == TraceKind::throttle || event.kind == TraceKind::finish;
    if (leaves && running.vcpu == event.vcpu) end_stretch(event.core, event.time);
    const bool interrupt = event.kind == TraceKind::interrupt;
    add(chrome::instant(kKinds(event.kind), event.core, interrupt ? chrome::kInterruptThread : event.vcpu,
                        microseconds(to_ns(event.time)),
                        interrupt ? chrome::device(board::sim::interrupt_name(event.vcpu)) : ""));
}

Result<void> ChromeTrace::finish(Instant now) {
    for (int core = 0; core < static_cast<int>(running_.size()); ++core) end_stretch(core, now);
    std::fputs("\n]\n", file_);
    const bool failed = std::ferror(file_) != 0;
    const bool closed = std::fclose(file_) == 0;
    file_ = nullptr;
    if (failed || !closed)
        return make_error(ErrorCode::unavailable, "the trace could not be written whole: disk full?");
    return {};
}

}  // namespace qduino::apps
