#include "apps/host/chrome_trace.h"

#include <cerrno>
#include <cstring>

#include "base/words.h"
#include "runtime/plan.h"

namespace qduino::apps {

using board::sim::TraceEvent;
using board::sim::TraceKind;

namespace {

/// Microseconds, as text: a double would lose nanoseconds after some months.
struct Microseconds {
    explicit Microseconds(std::int64_t ns) {
        std::snprintf(text, sizeof text, "%lld.%03lld", static_cast<long long>(ns / 1000),
                      static_cast<long long>(ns % 1000));
    }
    char text[32];
};

constexpr Words<TraceKind::release, TraceKind::finish> kKinds{
    "release", "run", "preempt", "block", "throttle", "replenish", "overrun", "interrupt", "finish"};

constexpr int kInterruptThread = 1000;  // sorts after the VCPUs

constexpr Words<board::DeviceClass::gpio, board::DeviceClass::all> kDevices{"gpio", "i2c",  "spi", "uart",
                                                                            "nic",  "disk", "tick"};

}  // namespace

Result<std::unique_ptr<ChromeTrace>> ChromeTrace::create(const std::string& path) {
    std::FILE* file = std::fopen(path.c_str(), "w");
    if (!file) {
        const bool forbidden = errno == EACCES;
        return make_error(forbidden ? ErrorCode::not_permitted : ErrorCode::unavailable,
                          path + ": " + std::strerror(errno));
    }
    std::fputs("[\n", file);
    return std::unique_ptr<ChromeTrace>(new ChromeTrace(file));
}

ChromeTrace::~ChromeTrace() {
    if (file_) std::fclose(file_);
}

void ChromeTrace::begin_record() {
    std::fputs(first_ ? "" : ",\n", file_);
    first_ = false;
}

void ChromeTrace::name_thread(const TraceEvent& event) {
    const bool interrupt = event.kind == TraceKind::interrupt;
    bool& named = interrupt ? interrupts_named_[event.core] : named_[event.core][event.vcpu];
    if (named) return;
    named = true;
    begin_record();
    std::fprintf(file_, R"({"ph":"M","name":"thread_name","pid":%d,"tid":%d,"args":{"name":"%s"}})",
                 event.core, interrupt ? kInterruptThread : event.vcpu,
                 interrupt ? "interrupts" : runtime::vcpu_name(event.vcpu).c_str());
    begin_record();
    std::fprintf(file_, R"({"ph":"M","name":"process_name","pid":%d,"args":{"name":"core %d"}})", event.core,
                 event.core);
}

void ChromeTrace::end_stretch(int core, Instant now) {
    Running& running = running_[static_cast<std::size_t>(core)];
    if (running.vcpu == board::kNoVcpu) return;
    begin_record();
    std::fprintf(file_, R"({"ph":"X","name":"%s","pid":%d,"tid":%d,"ts":%s,"dur":%s})",
                 runtime::vcpu_name(running.vcpu).c_str(), core, running.vcpu,
                 Microseconds(to_ns(running.since)).text, Microseconds(to_ns(now - running.since)).text);
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
    begin_record();
    const Microseconds at(to_ns(event.time));
    if (event.kind == TraceKind::interrupt) {
        const auto device = static_cast<board::DeviceClass>(event.vcpu);
        std::fprintf(
            file_,
            R"({"ph":"i","s":"t","name":"interrupt","pid":%d,"tid":%d,"ts":%s,"args":{"device":"%s"}})",
            event.core, kInterruptThread, at.text, kDevices(device).data());
        return;
    }
    std::fprintf(file_, R"({"ph":"i","s":"t","name":"%s","pid":%d,"tid":%d,"ts":%s})",
                 kKinds(event.kind).data(), event.core, event.vcpu, at.text);
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
