// The link as the service sees it, with a damaged sketch at its other end: any bytes in the status
// slots, any bytes in the rings, at any time.
//
// Input: operations. First byte of each: 0 job status, 1 motion, 2 heat (then as many bytes as
// follow, up to the slot's size, laid over it), 3 replies (a length byte, then raw bytes), 4 the
// sketch is dead or not (from 128 on, then eight bytes of its time factor), 5 a tick, 6 a
// well-formed frame whose type and payload are the input's, 7 the guarantee report (two length
// bytes, then its text). Properties: every frame that the reader accepts encodes to the very bytes
// that it was read from; the status and the guarantee report that go out are valid JSON, and a
// report that passed once passes again; a job is never begun twice with the same run.
#include <cstdint>
#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>

#include "printer/link/frame.h"
#include "spool/memory_storage.h"
#include "spool/spool.h"
#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/api/guarantee.h"
#include "web/api/json.h"

namespace {

using namespace qduino;
using printer::link::LinkLayout;

class FixedLink final : public spool::LinkSource {
  public:
    explicit FixedLink(LinkLayout* layout) : layout_(layout) {}
    LinkLayout* current() override { return open_ ? layout_ : nullptr; }
    bool is_replaced() override { return !open_; }
    void reopen() override { open_ = true; }

  private:
    LinkLayout* layout_;
    bool open_ = false;
};

class Input {
  public:
    Input(const std::uint8_t* data, std::size_t size) : rest_(data, size) {}
    [[nodiscard]] bool empty() const { return rest_.empty(); }
    std::uint8_t byte() {
        const auto taken = take(1);
        return taken.empty() ? 0 : taken[0];
    }
    std::span<const std::uint8_t> take(std::size_t count) {
        const auto taken = rest_.first(std::min(count, rest_.size()));
        rest_ = rest_.subspan(taken.size());
        return taken;
    }

  private:
    std::span<const std::uint8_t> rest_;
};

class World {
  public:
    World() : layout_(std::make_unique<LinkLayout>()), link_(layout_.get()) {
        layout_->session = 1;
        spool::SpoolOptions options;
        options.hold_after_failure = false;
        auto storage = std::make_unique<spool::MemoryStorage>(spool::MemoryFiles::Limits{1, 1000, 0});
        spool_ = std::move(spool::Spool::open(options, std::move(storage), link_, nullptr)).value();
        FUZZ_EXPECT(spool_->bed_cleared());
        auto file = spool_->files().stage().value();
        FUZZ_EXPECT(file->write(std::string_view{"G28\nG1 X1 F600\n"}).ok() && file->seal().ok());
        job_ = *spool_->add(*file, {}, {"fuzz.gcode", 1, 0, false}, 1);
    }

    void run(Input input) {
        for (int steps = 0; !input.empty() && steps < 200; ++steps) step(input);
        tick();
        // Once an input: writing JSON takes longer than all the rest.
        FUZZ_EXPECT(nlohmann::json::accept(web::api::text_of(web::api::status_json(*spool_))));
        FUZZ_EXPECT(nlohmann::json::accept(web::api::text_of(web::api::jobs_json(*spool_))));
        if (const auto report = web::api::checked_guarantee(spool_->guarantee())) {
            const auto again = web::api::checked_guarantee(web::api::text_of(*report));
            FUZZ_EXPECT(again && *again == *report);
        }
    }

  private:
    void step(Input& input) {
        switch (input.byte() % 8) {
            case 0:
                overlay(job_status_, input), layout_->job_status.write(job_status_);
                return;
            case 1:
                overlay(motion_, input), layout_->motion_status.write(motion_);
                return;
            case 2:
                overlay(heat_, input), layout_->heat_status.write(heat_);
                return;
            case 3:
                static_cast<void>(layout_->replies.try_push_all(input.take(input.byte())));
                return;
            case 4: {
                const std::uint8_t dead = input.byte();
                layout_->sketch_dead.store(dead % 4);
                if (dead >= 128) set_time_factor(input.take(sizeof(double)));
                return;
            }
            case 5:
                tick();
                return;
            case 7: {
                const std::size_t high = input.byte();
                return publish(input.take(high * 256 + input.byte()));
            }
            default: {
                const std::uint8_t type = input.byte();
                round_trip(printer::link::encode_raw(type, input.take(input.byte())));
                return;
            }
        }
    }

    void set_time_factor(std::span<const std::uint8_t> bytes) {
        double factor = 0;
        if (!bytes.empty()) std::memcpy(&factor, bytes.data(), bytes.size());
        layout_->time_factor.store(factor);
    }

    void publish(std::span<const std::uint8_t> text) {
        layout_->guarantee.write({std::string_view{reinterpret_cast<const char*>(text.data()), text.size()}});
    }

    template <typename Slot>
    static void overlay(Slot& slot, Input& input) {
        const std::size_t at = input.byte() * 4u % sizeof(Slot);
        const auto bytes = input.take(std::min<std::size_t>(input.byte(), sizeof(Slot) - at));
        if (!bytes.empty())
            std::memcpy(reinterpret_cast<std::uint8_t*>(&slot) + at, bytes.data(), bytes.size());
    }

    void round_trip(const printer::link::Frame& frame) {
        FUZZ_EXPECT(layout_->commands.try_push_all(frame.bytes()) || layout_->commands.size() > 0);
        printer::link::FrameReader reader;
        const auto read = reader.read(layout_->commands);
        if (read.ok() && read->has_value()) {
            const auto again =
                printer::link::encode_raw(static_cast<std::uint8_t>((*read)->type), (*read)->payload);
            FUZZ_EXPECT(std::equal(again.bytes().begin(), again.bytes().end(), frame.bytes().begin(),
                                   frame.bytes().end()));
            static_cast<void>(printer::link::decode_job_begin((*read)->payload));
            static_cast<void>(printer::link::decode_job_bytes((*read)->payload));
            static_cast<void>(printer::link::decode_job_end((*read)->payload));
            static_cast<void>(printer::link::decode_command((*read)->payload));
            static_cast<void>(printer::link::decode_reply((*read)->payload));
        }
        layout_->commands.discard_all();
    }

    void tick() {
        now_ += std::chrono::milliseconds{100};
        spool_->tick(now_, 1 + to_ns(now_) / 1'000'000'000);
        if (const auto& run = spool_->active_run()) {
            FUZZ_EXPECT(run->id >= last_run_);
            last_run_ = run->id;
        }
        for (const spool::Reply& reply : spool_->take_replies()) {
            const web::api::Json json{{"text", reply.text}};
            FUZZ_EXPECT(nlohmann::json::accept(web::api::text_of(json)));
        }
        static_cast<void>(spool_->take_log());
        layout_->jobs.discard_all();
        layout_->commands.discard_all();
        static_cast<void>(spool_->start(job_));  // printed again, once it has ended
    }

    std::unique_ptr<LinkLayout> layout_;
    FixedLink link_;
    std::unique_ptr<spool::Spool> spool_;
    spool::JobId job_ = 0;
    std::uint64_t last_run_ = 0;
    Instant now_ = instant_from_ns(1'000'000'000);
    printer::link::JobStatus job_status_;
    printer::link::MotionStatus motion_;
    printer::link::HeatStatus heat_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    static World world;
    world.run(Input{data, size});
    return 0;
}
