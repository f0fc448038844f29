#include "qduino/build/loose_pins.h"

#include <utility>

namespace qduino::apps {

using board::linux::PinsServer;

namespace {

/// Between two looks at the rings, unless the sketch asks for something.
constexpr Nanoseconds kLookEvery = 5ms;

}  // namespace

LoosePins::LoosePins(PinsServer server) : server_(std::move(server)) { witness_.forward_to(nothing_); }

Result<std::unique_ptr<LoosePins>> LoosePins::serve(const std::filesystem::path& pins, bool dump,
                                                    Nanoseconds from) {
    QDUINO_TRY_ASSIGN(PinsServer server, PinsServer::create(pins));
    std::unique_ptr<LoosePins> made{new LoosePins{std::move(server)}};
    made->witness_.rows_from(from);
    if (dump) QDUINO_TRY(made->witness_.keep_dump());
    made->thread_ = std::thread{[served = made.get()] { served->listen(); }};
    return made;
}

LoosePins::~LoosePins() { end(); }

void LoosePins::listen() {
    while (!stop_.load()) {
        if (server_.poll(server_.past(), witness_) < PinsServer::kBatch) server_.wait(kLookEvery);
    }
}

void LoosePins::end() {
    stop_.store(true);
    if (!thread_.joinable()) return;
    thread_.join();
    while (server_.poll(server_.now(), witness_) >= PinsServer::kBatch) {
    }
    witness_.end(server_.horizon());
}

}  // namespace qduino::apps
