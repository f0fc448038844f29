// The memory between Linux and the board on the core that Linux gave up: one range that Linux's
// boot line keeps free, laid out here and nowhere else.
//
//   where          what                                     the board sees it at
//   base           BesideArea: facts, heartbeats, Serial    the same address
//   base +  2 MiB  the image, its stacks, its heap          kImageAt, where it is linked for
//   base + 48 MiB  virtual pins (pins_layout.h)             the same address
//   behind them    kBesideServiceBytes for an image that    the same address
//                  has a service on Linux: the printer's
//                  link (beside/link_relay.h)
//
//   Linux: launcher                          board/metal, on its own core
//   keeper ── keeper_beats ────────────────► silence longer than silence_limit_ns: safe levels, end
//   launcher ◄──── board_beats, board_ns ─── each look at the keeper
//            ── stop_asked ────────────────► the loops end
//            ◄──── state, status ───────────
//            ◄═ reports, Serial ═ Serial ══►
//
// The board's page tables are in here too, made by the launcher: they map this range, the page
// with the trampoline and the local APIC, and none of Linux's memory. Linux maps what it likes.
//
// The words have one writer each. A zeroed area is one before anything was written.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include "board/window/pins_layout.h"
#include "channel/ring_buffer.h"

namespace qduino::board {

/// How far the board has come.
enum class BesideState : std::uint32_t { off = 0, booted = 1, runs = 2, ended = 3 };
/// Its status at the end, beside 0 (well), 1 (failed) and 2 (refused): Linux was silent.
inline constexpr std::uint32_t kEndedBySilence = 3;

/// Serial, both ways, and the board's reports.
struct BesideLine {
    channel::RingBuffer<std::uint8_t, 16384> out;
    channel::RingBuffer<std::uint8_t, 1024> in;
    channel::RingBuffer<std::uint8_t, 65536> reports;
};

using PageTable = std::array<std::uint64_t, 512>;

/// What an x86-64 processor walks through to find the memory below 4 GiB (Intel SDM volume 3, 4.5).
struct BesideTables {
    alignas(4096) PageTable map{};
    alignas(4096) PageTable pointers{};
    alignas(4096) std::array<PageTable, 4> directories{};  ///< an entry for each 2 MiB
    alignas(4096) PageTable first_pages{};                 ///< of the first 2 MiB
};

struct BesideArea {
    // ---- facts: written before the board starts -------------------------------------------------
    std::uint64_t clock_hz = 0;         ///< of the time-stamp counter
    std::uint64_t image_offset = 0;     ///< memory's address of the image, less kImageAt
    std::uint64_t pins_at = 0;          ///< of PinsLayout
    std::uint32_t core = 0;             ///< Linux's number of the core
    std::int64_t silence_limit_ns = 0;  ///< 0: the board goes on without Linux
    std::array<char, 256> words{};      ///< the image's command line; ends with a zero

    // ---- Linux writes ---------------------------------------------------------------------------
    alignas(channel::kLinePair) std::atomic<std::uint64_t> keeper_beats{0};
    std::atomic<std::uint32_t> stop_asked{0};

    // ---- the board writes -----------------------------------------------------------------------
    alignas(channel::kLinePair) std::atomic<std::uint64_t> board_beats{0};
    std::atomic<std::int64_t> board_ns{0};  ///< its clock at that beat
    std::atomic<BesideState> state{BesideState::off};
    std::atomic<std::uint32_t> status{0};  ///< once it has ended
    // The silence that ended it, on its clock; 0: none did.
    std::atomic<std::int64_t> last_beat_ns{0};  ///< when the keeper was last seen to have beaten
    std::atomic<std::int64_t> safe_ns{0};       ///< when all safe levels were driven

    alignas(channel::kLinePair) BesideLine line;
    BesideTables tables;
};

// ---- where things are ---------------------------------------------------------------------------
inline constexpr std::size_t kLargePage = std::size_t{2} << 20;
/// board/metal/x86/image.ld
inline constexpr std::uint64_t kImageAt = 16 << 20;
inline constexpr std::size_t kImageOffset = kLargePage;
inline constexpr std::size_t kImageBytes = 23 * kLargePage;
inline constexpr std::size_t kBesidePinsOffset = kImageOffset + kImageBytes;
/// The rings that a board without Linux uses are those of its VCPUs: the wide ones are left out.
inline constexpr std::size_t kBesideServiceOffset =
    (kBesidePinsOffset + ring_offset(kVcpuLimit) + kLargePage - 1) / kLargePage * kLargePage;
inline constexpr std::size_t kBesideServiceBytes = kLargePage;
inline constexpr std::size_t kBesideBytes = kBesideServiceOffset + kBesideServiceBytes;
static_assert(sizeof(BesideArea) <= kImageOffset);
/// The range begins at a multiple of kLargePage, behind the image's own addresses, and ends before
/// the devices' addresses.
inline constexpr std::uint64_t kBesideLowest = kImageAt + kImageBytes;
inline constexpr std::uint64_t kBesideHighest = std::uint64_t{3} << 30;

/// What the trampoline's last words are; the launcher writes them into its copy.
struct TrampolineEnd {
    std::uint32_t tables_at = 0;  ///< BesideTables::map
    std::uint32_t area_at = 0;
};
/// The image's note about its trampoline: of owner kBesideNoteName and this kind. Its words are the
/// trampoline's address in the image, and its size.
inline constexpr char kBesideNoteName[] = "Qduino";
inline constexpr std::uint32_t kBesideNoteKind = 1;

}  // namespace qduino::board
