// The whole way of an upload without its socket: bytes → connection → service → spool, with the
// journal in memory.
//
// Input: one byte that seeds the cutting into reads, then the peer's bytes. Authentication is off,
// so that the fuzzer need not guess a key. Properties: every answer begins as HTTP does and comes
// when the one before is sent; memory stays bounded; nothing stays in incoming/, and nothing is
// there once a refusal is answered; a queued job is stored whole under its own SHA-256.
#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <deque>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/connection.h"

namespace {

using namespace qduino;
using namespace qduino::web;

class NoLink final : public spool::LinkSource {
  public:
    printer::link::LinkLayout* current() override { return nullptr; }
    bool is_replaced() override { return false; }
    void reopen() override {}
};

/// Judges by the first byte, a small letter as soon as it is there and a large one at the file's
/// end; and by an 'x', wherever it stands. The real one has a fuzz target of its own.
class AnyReading final : public spool::FileReading {
  public:
    std::optional<spool::Analysis> feed(std::span<const char> bytes) override {
        FUZZ_EXPECT(!bytes.empty() && !refused_);
        if (first_ == 0) first_ = bytes.front();
        const bool violates = first_ == 'v' || std::ranges::find(bytes, 'x') != bytes.end();
        refused_ = violates || first_ == 'n';
        using Verdict = spool::Analysis::Verdict;
        if (!refused_) return std::nullopt;
        return analysis_of(violates ? Verdict::violation : Verdict::not_gcode);
    }
    Result<spool::Analysis> finish() override {
        FUZZ_EXPECT(!refused_);
        if (first_ == 'E') return make_error(ErrorCode::unavailable, "no room for layers");
        using Verdict = spool::Analysis::Verdict;
        return analysis_of(first_ == 'N'   ? Verdict::not_gcode
                           : first_ == 'V' ? Verdict::violation
                                           : Verdict::fits);
    }

  private:
    static spool::Analysis analysis_of(spool::Analysis::Verdict verdict) {
        spool::Analysis analysis;
        analysis.verdict = verdict;
        return analysis;
    }
    char first_ = 0;
    bool refused_ = false;
};

class AnyAnalyzer final : public spool::Analyzer {
  public:
    std::unique_ptr<spool::FileReading> begin(const std::filesystem::path&) override {
        return std::make_unique<AnyReading>();
    }
};

class World {
  public:
    World() : folder_(make_folder()) {
        spool::SpoolOptions options;
        options.folder = folder_;
        options.limits = {64 * 1024, 0};
        options.journal_in_memory = true;
        spool_ = std::move(spool::Spool::open(options, link_, nullptr)).value();
        const Executor at_once = [this](Task task) { run(std::move(task)); };
        service_ = std::make_unique<Service>(
            ServiceOptions{HostPolicy{{}}, 4}, api::Context{*spool_, {}, "{}", "", {}}, Authenticator{"", {}},
            StaticFiles{}, analyzer_, Executors{at_once, at_once, at_once, at_once});
    }
    ~World() { std::filesystem::remove_all(folder_); }

    void serve(std::string_view bytes, std::uint64_t seed) {
        std::mt19937_64 random{seed};
        Moment moment{instant_from_ns(1'000'000'000), 1'700'000'000};
        auto connection = std::make_shared<Connection>(
            *service_, Peer{"127.0.0.1", false}, [] {}, moment);
        while (!bytes.empty() && connection->wants_input()) {
            const std::size_t count = std::min<std::size_t>(1 + random() % 600, bytes.size());
            moment.now += std::chrono::milliseconds{1 + random() % 400};
            connection->receive({bytes.data(), count}, moment);
            connection->check_time(moment);
            bytes.remove_prefix(count);
            check_output(*connection, moment);
            // A refusal that is answered leaves nothing behind, however much is still to come.
            if (connection->wants_close()) FUZZ_EXPECT(std::filesystem::is_empty(folder_ / "incoming"));
            FUZZ_EXPECT(connection->held_bytes() < 2 * ReadLimits{}.header_bytes_max + 64 * 1024);
        }
        connection->receive_end();
        check_output(*connection, moment);
        connection.reset();
        check_store();
    }

  private:
    static std::filesystem::path make_folder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "fuzz-upload-XXXXXX").string();
        FUZZ_EXPECT(::mkdtemp(pattern.data()) != nullptr);
        return pattern;
    }
    void run(Task task) {
        tasks_.push_back(std::move(task));
        if (tasks_.size() > 1) return;
        for (; !tasks_.empty(); tasks_.pop_front()) tasks_.front()();
    }
    static void check_output(Connection& connection, Moment moment) {
        while (const auto output = connection.take_output()) {
            FUZZ_EXPECT(output->bytes.starts_with("HTTP/1.1 "));
            FUZZ_EXPECT(!connection.take_output());  // one is in hand
            connection.sent(moment);
        }
    }
    void check_store() {
        FUZZ_EXPECT(std::filesystem::is_empty(folder_ / "incoming"));
        spool::JobQuery all;
        all.limit = spool::JobQuery::kLimitMax;
        const auto page = spool_->page(all);
        FUZZ_EXPECT(page.ok() && !page->next_before);
        for (const spool::Job& job : page->jobs) {
            std::ifstream file{spool_->blobs().path(job.sha256, spool::BlobPart::gcode), std::ios::binary};
            const std::string bytes{std::istreambuf_iterator<char>{file}, {}};
            FUZZ_EXPECT(bytes.size() == job.size && spool::sha256_of(bytes) == job.sha256);
            FUZZ_EXPECT(spool::check_name(job.name).ok());
        }
        for (const spool::Job& job : page->jobs) FUZZ_EXPECT(spool_->remove(job.id).ok());
        FUZZ_EXPECT(spool_->counts().total() == 0 && spool_->store().stored_bytes() == 0);
        FUZZ_EXPECT(std::filesystem::is_empty(folder_ / "blobs"));
        static_cast<void>(spool_->take_log());
    }

    std::filesystem::path folder_;
    NoLink link_;
    AnyAnalyzer analyzer_;
    std::deque<Task> tasks_;
    std::unique_ptr<spool::Spool> spool_;
    std::unique_ptr<Service> service_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static World world;
    if (size > 0) world.serve({reinterpret_cast<const char*>(data) + 1, size - 1}, data[0]);
    return 0;
}
