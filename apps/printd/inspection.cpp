#include "apps/printd/inspection.h"

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <nlohmann/json.hpp>
#include <utility>

namespace qduino::printd {

namespace {

constexpr Nanoseconds kBeginTimeout = std::chrono::seconds{5};
constexpr Nanoseconds kEndTimeout = std::chrono::seconds{60};
constexpr std::size_t kAnswersKept = 16;

}  // namespace

Inspection::Inspection(const std::string& socket)
    : client_(socket), thread_(std::make_unique<boost::asio::thread_pool>(1)) {}
Inspection::~Inspection() = default;

void Inspection::begin(std::uint64_t run, const std::string& gcode) {
    const std::scoped_lock lock{mutex_};
    Answers& answers = answers_[run];
    if (std::exchange(answers.begin_asked, true)) return;
    while (answers_.size() > kAnswersKept) answers_.erase(answers_.begin());
    boost::asio::post(*thread_, [this, run, path = std::filesystem::absolute(gcode).string()] {
        // Whatever the answer: the job prints without an inspector, too.
        static_cast<void>(client_.job_begin(std::to_string(run), path, kBeginTimeout));
        const std::scoped_lock answered{mutex_};
        answers_[run].begin_answered = true;
    });
}

bool Inspection::begun(std::uint64_t run) {
    const std::scoped_lock lock{mutex_};
    const auto at = answers_.find(run);
    return at != answers_.end() && at->second.begin_answered;
}

void Inspection::typed(std::uint64_t run, std::uint32_t number, std::uint64_t behind_line, double left_mm,
                       const std::string& line) {
    boost::asio::post(*thread_, [this, run, number, behind_line, left_mm, line] {
        static_cast<void>(
            client_.job_typed(std::to_string(run), number, behind_line, left_mm, line, kBeginTimeout));
    });
}

void Inspection::end(std::uint64_t run, std::uint32_t excursions) {
    const std::scoped_lock lock{mutex_};
    if (std::exchange(answers_[run].end_asked, true)) return;
    boost::asio::post(*thread_, [this, run, excursions] {
        std::string report = ask_end(run, excursions);
        const std::scoped_lock answered{mutex_};
        answers_[run].report = std::move(report);
    });
}

std::optional<std::string> Inspection::report(std::uint64_t run) {
    const std::scoped_lock lock{mutex_};
    const auto at = answers_.find(run);
    return at == answers_.end() ? std::nullopt : at->second.report;
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
