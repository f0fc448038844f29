// The printer's link, when the printer runs on a core that Linux gave up.
//
//   printd ◄─ FILE, a link as ever ─► this relay, root ◄─ a link in the reserved memory ─► loops
//          jobs, commands, emergency, heartbeat of the service ───►
//          ◄─── replies, status, what a step takes
//
// Both are printer/link/layout.h's. printd could map the reserved memory only through /dev/mem,
// and then all other memory, too: it would have to be root, and it reads what strangers upload. So
// it keeps its file and its rights, and this process carries. FILE is a new object for each run, as
// the service expects, while the memory is always the same one.
//
//   printd is killed      the loops print on from what both rings hold; bytes that it had pushed
//                         still go over, and it goes on from `bytes_accepted`
//   this process is       Linux's heartbeat ends with it: safe levels
//   the run ends          FILE says that its sketch is dead
//
// Neither side is trusted: a frame is the sketch's to check (printer/link/frame.h), and a ring is
// bounded whatever its counters say. An emergency stop is as late as the passes are apart, 1 ms.
#pragma once

#include <filesystem>

#include "base/result.h"
#include "base/time.h"
#include "board/window/beside_layout.h"
#include "link/link_file.h"
#include "printer/link/layout.h"

namespace qduino::apps::beside_linux {

static_assert(sizeof(printer::link::LinkLayout) <= board::kBesideServiceBytes);

class LinkRelay {
  public:
    /// `board`: zeroed, until the image makes a link of it. `path`: empty: nothing is carried.
    LinkRelay(printer::link::LinkLayout& board, std::filesystem::path path)
        : board_(board), path_(std::move(path)) {}
    ~LinkRelay();
    LinkRelay(const LinkRelay&) = delete;
    LinkRelay& operator=(const LinkRelay&) = delete;

    /// Carries what there is, both ways. Makes FILE when the image has made its link. Error:
    /// unsupported (the image is of another version), the system's, where FILE cannot be made.
    Result<void> pass(Instant now);

  private:
    void to_board();
    void to_service();
    void tell_status();

    printer::link::LinkLayout& board_;
    std::filesystem::path path_;
    LinkFile file_;
    Instant next_status_ = kEpoch;
};

}  // namespace qduino::apps::beside_linux
