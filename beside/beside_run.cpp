#include "beside/beside_run.h"

#include <fcntl.h>
#include <linux/capability.h>
#include <poll.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <new>
#include <optional>
#include <utility>

#include "base/text.h"
#include "beside/beside_image.h"
#include "beside/boot_line.h"
#include "beside/given_core.h"
#include "beside/keeper.h"
#include "beside/link_relay.h"
#include "board/linux/kernel/clock.h"
#include "board/linux/kernel/cycle_clock.h"
#include "board/linux/kernel/real_time_thread.h"
#include "board/linux/pin/pins_server.h"
#include "board/window/beside_layout.h"
#include "posix/mapping.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"
#include "terminal/message.h"
#include "terminal/program.h"

namespace qduino::apps::beside_linux {
namespace {

using board::BesideArea;
using board::BesideState;
using board::linux::monotonic_now;
using board::linux::PinsServer;

constexpr const char* kMemory = "/dev/mem";

// ---- before the start ---------------------------------------------------------------------------

Result<Places> find_places() {
    const BootLine line = read_boot_line(this_computer(""));
    if (!line.missing.empty())
        return make_error(ErrorCode::unavailable,
                          "Linux was not booted for this. Its boot line lacks: ", joined(line.missing),
                          ". 'qduino doctor' has the command (docs/metal.md)");
    if (!board::linux::has_capability(CAP_SYS_RAWIO))
        return make_error(ErrorCode::not_permitted,
                          "a core and its memory are root's to give: run it as root");
    return Places{.memory_at = line.memory_at, .page_at = line.page_at};
}

struct Reading {
    std::uint64_t cycles = 0;
    std::int64_t ns = 0;
};

/// Both clocks at once: the narrowest of some tries.
Reading read_both() {
    Reading best;
    std::uint64_t narrowest = UINT64_MAX;
    for (int i = 0; i < 20; ++i) {
        const std::uint64_t before = board::linux::read_cycles();
        const std::int64_t ns = board::linux::read_clock_ns(CLOCK_MONOTONIC_RAW);
        const std::uint64_t width = board::linux::read_cycles() - before;
        if (width >= narrowest) continue;
        narrowest = width;
        best = {.cycles = before + width / 2, .ns = ns};
    }
    return best;
}

/// The rate of the time-stamp counter, by Linux's clock.
std::uint64_t measure_clock_hz() {
    const Reading first = read_both();
    board::linux::block_until(monotonic_now() + 100ms);
    const Reading last = read_both();
    return static_cast<std::uint64_t>(static_cast<double>(last.cycles - first.cycles) * 1e9 /
                                      static_cast<double>(last.ns - first.ns));
}

/// The memory that both share, mapped, and filled for one start.
class SharedMemory {
  public:
    static Result<SharedMemory> open(const Places& places) {
        SharedMemory memory;
        memory.places_ = places;
        const posix::UniqueFd file{::open(kMemory, O_RDWR | O_CLOEXEC)};
        if (!file.valid()) return posix::system_error("open", kMemory);
        QDUINO_TRY_ASSIGN(memory.range_,
                          posix::map_shared(file.get(), places.memory_at, board::kBesidePinsOffset, false));
        QDUINO_TRY_ASSIGN(memory.service_,
                          posix::map_shared(file.get(), places.memory_at + board::kBesideServiceOffset,
                                            board::kBesideServiceBytes, false));
        QDUINO_TRY_ASSIGN(memory.page_, posix::map_shared(file.get(), places.page_at, kPage, false));
        return memory;
    }

    [[nodiscard]] BesideArea& area() const { return *range_.as<BesideArea>(); }
    [[nodiscard]] printer::link::LinkLayout& link() const {
        return *service_.as<printer::link::LinkLayout>();
    }

    /// All that the core needs to begin. Error: those of load_image().
    Result<void> fill(std::span<const std::uint8_t> image, const BesideOptions& options) {
        auto* const bytes = range_.as<std::uint8_t>();
        QDUINO_TRY_ASSIGN(const auto trampoline,
                          load_image(image, {bytes + board::kImageOffset, board::kImageBytes}));
        auto* const area = new (bytes) BesideArea;
        // No link, until the image makes one.
        new (service_.as<std::uint8_t>()) printer::link::LinkLayout;
        area->clock_hz = measure_clock_hz();
        area->image_offset = places_.memory_at + board::kImageOffset - board::kImageAt;
        area->pins_at = places_.memory_at + board::kBesidePinsOffset;
        area->core = static_cast<std::uint32_t>(options.core);
        area->silence_limit_ns = options.silence.count();
        if (options.words.size() >= area->words.size())
            return make_error(ErrorCode::invalid_argument, "too many words for the image");
        std::ranges::copy(options.words, area->words.begin());
        map_memory(places_, area->tables);
        place_trampoline(trampoline, places_, {page_.as<std::uint8_t>(), kPage});
        return {};
    }

  private:
    Places places_;
    posix::Mapping range_, page_, service_;
};

/// Serves the pins; nothing where another program does.
Result<std::optional<PinsServer>> serve_pins(const Places& places) {
    const auto path = text<std::string>(kMemory, '@', places.memory_at + board::kBesidePinsOffset);
    auto server = PinsServer::create(path, true);
    if (server) return std::optional<PinsServer>{std::move(*server)};
    if (server.error().code == ErrorCode::unavailable) return std::optional<PinsServer>{};
    return server.error();
}

// ---- while it runs ------------------------------------------------------------------------------

/// Serial and the reports, between the board's rings and this terminal.
class Terminal {
  public:
    explicit Terminal(board::BesideLine& line) : line_(line) {}

    void pass() {
        print(line_.out, STDOUT_FILENO);
        print(line_.reports, STDERR_FILENO);
        listen();
    }

  private:
    template <typename Ring>
    static void print(Ring& ring, int to) {
        std::array<std::uint8_t, 4096> bytes;
        while (const std::size_t count = ring.pop_some(bytes))
            static_cast<void>(
                posix::write_all(to, {reinterpret_cast<const char*>(bytes.data()), count}, "the terminal"));
    }

    void listen() {
        pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
        std::array<std::uint8_t, 256> bytes;
        const std::size_t room = std::min(bytes.size(), line_.in.free());
        if (!listens_ || room == 0 || ::poll(&input, 1, 0) <= 0) return;
        const ssize_t count = ::read(STDIN_FILENO, bytes.data(), room);
        listens_ = count > 0;
        if (count > 0) line_.in.push_some({bytes.data(), static_cast<std::size_t>(count)});
    }

    board::BesideLine& line_;
    bool listens_ = true;  // standard input has not ended
};

/// The board's heartbeat, as Linux sees it.
class BoardWatch {
  public:
    explicit BoardWatch(const BesideArea& area) : area_(area), seen_at_(monotonic_now()) {}

    /// Error: it does not start, or stands still.
    Result<void> look() {
        constexpr Nanoseconds kToStart = 5s, kBetweenBeats = 2s;
        const Instant now = monotonic_now();
        const BesideState state = area_.state.load(std::memory_order_acquire);
        const std::uint64_t beats = area_.board_beats.load(std::memory_order_acquire);
        // setup() may take long.
        if (beats != beats_ || state == BesideState::booted) seen_at_ = now;
        beats_ = beats;
        const Nanoseconds silent = now - seen_at_;
        if (state == BesideState::off && silent > kToStart)
            return make_error(ErrorCode::faulted, "the core does not start");
        if (state == BesideState::runs && silent > kBetweenBeats)
            return make_error(ErrorCode::faulted, "the board stands still: no heartbeat for ",
                              Fixed{to_seconds(silent), 1}, " s. Its pins are as it left them");
        return {};
    }

  private:
    const BesideArea& area_;
    Instant seen_at_;
    std::uint64_t beats_ = 0;
};

class BesideRun {
  public:
    BesideRun(BesideArea& area, std::optional<PinsServer> pins, board::Peripherals& wired, LinkRelay& relay)
        : area_(area),
          pins_(std::move(pins)),
          wired_(wired),
          relay_(relay),
          terminal_(area.line),
          watch_(area) {}

    /// Until the board has ended. Error: it stands still.
    Result<void> serve() {
        constexpr Nanoseconds kToStop = 5s;
        Instant give_up = kForever;
        while (area_.state.load(std::memory_order_acquire) != BesideState::ended) {
            pass();
            QDUINO_TRY(relay_.pass(monotonic_now()));
            QDUINO_TRY(watch_.look());
            if (stop_asked() && give_up == kForever) {
                give_up = monotonic_now() + kToStop;
                area_.stop_asked.store(1, std::memory_order_release);
            }
            if (monotonic_now() > give_up)
                return make_error(ErrorCode::timed_out, "the board does not end: its core is stopped");
            rest();
        }
        pass();
        return relay_.pass(monotonic_now());
    }

  private:
    void pass() {
        terminal_.pass();
        while (pins_ && pins_->poll(pins_->past(), wired_) >= PinsServer::kBatch) {
        }
    }
    void rest() {
        constexpr Nanoseconds kPass = 1ms;
        if (pins_)
            pins_->wait(kPass);
        else
            board::linux::block_until(monotonic_now() + kPass);
    }

    BesideArea& area_;
    std::optional<PinsServer> pins_;
    board::Peripherals& wired_;
    LinkRelay& relay_;
    Terminal terminal_;
    BoardWatch watch_;
};

}  // namespace

Result<int> run_beside(std::span<const std::uint8_t> image, const BesideOptions& options,
                       board::Peripherals& wired) {
    QDUINO_TRY_ASSIGN(const Places places, find_places());
    QDUINO_TRY_ASSIGN(SharedMemory memory, SharedMemory::open(places));
    stop_on_signals();
    ::signal(SIGHUP, [](int) { ::raise(SIGTERM); });  // the terminal is closed
    ::signal(SIGPIPE, SIG_IGN);                       // what shows Serial has ended
    static_cast<void>(board::linux::lock_memory());   // the heartbeat must not wait for a page
    QDUINO_TRY_ASSIGN(GivenCore core, GivenCore::take(options.core));
    QDUINO_TRY(memory.fill(image, options));
    QDUINO_TRY_ASSIGN(auto pins, serve_pins(places));
    BesideArea& area = memory.area();
    const Keeper keeper{area.keeper_beats, options.silence > Nanoseconds{0}
                                               ? std::min<Nanoseconds>(options.silence / 5, 10ms)
                                               : 10ms};
    LinkRelay relay{memory.link(), options.link};
    core.start(places.page_at);
    const Result<void> served = BesideRun{area, std::move(pins), wired, relay}.serve();
    QDUINO_TRY(core.give_back());
    QDUINO_TRY(served);
    return static_cast<int>(area.status.load(std::memory_order_relaxed));
}

}  // namespace qduino::apps::beside_linux
