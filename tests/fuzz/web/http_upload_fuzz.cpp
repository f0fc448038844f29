// The whole way of an upload without its socket: bytes → connection → service → spool, with
// jobs and files in memory.
//
// Input: one byte that seeds the cutting into reads, then the peer's bytes. Authentication is off,
// so that the fuzzer need not guess a key. Properties: every answer begins as HTTP does and comes
// when the one before is sent; memory stays bounded; an upload that is over, or whose
// refusal is answered, gives its place back; a queued job is stored whole under its own SHA-256.
#include <algorithm>
#include <cstdint>
#include <random>
#include <set>

#include "base/sha256.h"
#include "spool/memory_storage.h"
#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/connection.h"
#include "web/one_thread.h"

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
    std::unique_ptr<spool::FileReading> begin(ByteSink&) override { return std::make_unique<AnyReading>(); }
};

class World {
  public:
    World() {
        auto storage =
            std::make_unique<spool::MemoryStorage>(spool::MemoryFiles::Limits{kPlaces, 64 * 1024, 0});
        spool_ = std::move(spool::Spool::open({}, std::move(storage), link_, nullptr)).value();
        service_ = std::make_unique<Service>(
            ServiceOptions{HostPolicy{{}}, 4}, api::Context{*spool_, {}, "{}", "", {}},
            Authenticator{"", {}, no_token}, StaticFiles{}, analyzer_, thread_.executors());
    }

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
            if (connection->wants_close()) FUZZ_EXPECT(free_places() == kPlaces - files().size());
            FUZZ_EXPECT(connection->held_bytes() < 2 * ReadLimits{}.header_bytes_max + 64 * 1024);
        }
        connection->receive_end();
        check_output(*connection, moment);
        connection.reset();
        check_store();
    }

  private:
    static constexpr std::size_t kPlaces = 8;

    static std::string no_token() { return std::string(kTokenLength, 't'); }
    /// How many files the memory would take now.
    std::size_t free_places() {
        std::vector<std::unique_ptr<spool::StagedFile>> staged;
        while (auto next = spool_->files().stage()) staged.push_back(std::move(*next));
        return staged.size();
    }
    /// The files of jobs.
    std::set<std::string> files() {
        std::set<std::string> found;
        for (const spool::Job& job : spool_->queue().jobs()) found.insert(job.sha256);
        return found;
    }
    static void check_output(Connection& connection, Moment moment) {
        while (const auto output = connection.take_output()) {
            FUZZ_EXPECT(output->bytes.starts_with("HTTP/1.1 "));
            FUZZ_EXPECT(!connection.take_output());  // one is in hand
            connection.sent(moment);
        }
    }
    void check_store() {
        FUZZ_EXPECT(free_places() == kPlaces - files().size());
        spool::JobQuery all;
        all.limit = spool::JobQuery::kLimitMax;
        const auto page = spool_->page(all);
        FUZZ_EXPECT(page.ok() && !page->next_before);
        for (const spool::Job& job : page->jobs) {
            const auto file = spool_->files().content(job.sha256, spool::FilePart::gcode);
            const std::string bytes = read_whole(*file).value();
            BareSha256 hash;
            hash.add(bytes);
            FUZZ_EXPECT(bytes.size() == job.size && hash.finish() == job.sha256);
            FUZZ_EXPECT(spool::check_name(job.name).ok());
        }
        for (const spool::Job& job : page->jobs) FUZZ_EXPECT(spool_->remove(job.id).ok());
        FUZZ_EXPECT(spool_->counts().total() == 0 && spool_->store().stored_bytes() == 0);
        FUZZ_EXPECT(free_places() == kPlaces);
        static_cast<void>(spool_->take_log());
    }

    NoLink link_;
    AnyAnalyzer analyzer_;
    OneThread thread_;
    std::unique_ptr<spool::Spool> spool_;
    std::unique_ptr<Service> service_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static World world;
    if (size > 0) world.serve({reinterpret_cast<const char*>(data) + 1, size - 1}, data[0]);
    return 0;
}
