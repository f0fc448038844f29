#include "apps/printd/inspection.h"

#include <nlohmann/json.hpp>

namespace qduino::printd {

namespace {

constexpr Nanoseconds kBeginTimeout = std::chrono::seconds{5};
constexpr Nanoseconds kEndTimeout = std::chrono::seconds{60};
constexpr std::size_t kAnswersKept = 16;

}  // namespace

Inspection::Inspection(const std::string& socket) : client_(socket), thread_([this] { serve(); }) {}

Inspection::~Inspection() {
    {
        const std::scoped_lock lock{mutex_};
        stop_ = true;
    }
    asked_.notify_all();
    thread_.join();
}

void Inspection::ask(Question question) {
    questions_.push_back(std::move(question));
    asked_.notify_all();
}

void Inspection::begin(std::uint64_t run, const std::filesystem::path& gcode) {
    const std::scoped_lock lock{mutex_};
    Answers& answers = answers_[run];
    if (std::exchange(answers.begin_asked, true)) return;
    while (answers_.size() > kAnswersKept) answers_.erase(answers_.begin());
    ask({run, std::filesystem::absolute(gcode).string(), false, 0});
}

bool Inspection::begun(std::uint64_t run) {
    const std::scoped_lock lock{mutex_};
    const auto at = answers_.find(run);
    return at != answers_.end() && at->second.begin_answered;
}

void Inspection::end(std::uint64_t run, std::uint32_t excursions) {
    const std::scoped_lock lock{mutex_};
    if (std::exchange(answers_[run].end_asked, true)) return;
    ask({run, {}, true, excursions});
}

std::optional<std::string> Inspection::report(std::uint64_t run) {
    const std::scoped_lock lock{mutex_};
    const auto at = answers_.find(run);
    return at == answers_.end() ? std::nullopt : at->second.report;
}

void Inspection::serve() {
    std::unique_lock lock{mutex_};
    while (true) {
        asked_.wait(lock, [this] { return stop_ || !questions_.empty(); });
        if (stop_) return;
        const Question question = std::move(questions_.front());
        questions_.pop_front();
        lock.unlock();
        std::string report;
        if (question.is_end) {
            report = ask_end(question.run, question.excursions);
        } else {
            // Whatever the answer: the job prints without an inspector, too.
            static_cast<void>(client_.job_begin(std::to_string(question.run), question.path, kBeginTimeout));
        }
        lock.lock();
        Answers& answers = answers_[question.run];
        if (question.is_end) {
            answers.report = std::move(report);
        } else {
            answers.begin_answered = true;
        }
    }
}

/// The report alone; empty when there is none.
std::string Inspection::ask_end(std::uint64_t run, std::uint32_t excursions) const {
    const Result<std::string> answer = client_.job_end(std::to_string(run), excursions, kEndTimeout);
    if (!answer.ok()) return {};
    const auto json = nlohmann::ordered_json::parse(*answer, nullptr, false);
    if (!json.is_object() || !json.contains("report")) return {};
    return json["report"].dump();
}

}  // namespace qduino::printd
