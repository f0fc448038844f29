// The link's shared object as a file: the sketch creates it, the service opens it and notices when
// it was replaced.
//
//   sketch:   write DIR/.name.tmp.PID (zeroes, header, magic last) ── rename ──► DIR/name
//             (a new inode for every run)
//   service:  open DIR/name, check magic, version, size, lock it
//             later: is DIR/name still the same inode?
//
// Where the service is another user than the sketch (./run as root), the object is no file: who may
// write to a file may also cut it off, and a mapped page that is gone kills who touches it
// (SIGBUS). There the launcher makes the object, as memory that is sealed against that, and hands
// it over (apps/launcher/link_giver.h):
//
//   sketch, supervisor   inherit its descriptor: the path is /proc/self/fd/N
//   service, port        the path is a socket; who connects is given a descriptor
//
// Invariants: a process that opens the name sees a complete object or none. The object of one run
// of the sketch is never used by another run. At most one service holds an object (an advisory lock
// that dies with its holder).
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "posix/mapping.h"
#include "posix/unique_fd.h"
#include "printer/link/layout.h"

namespace qduino::apps {

/// A mapped link. Movable; unmaps when destroyed. The pointer stays valid and the same while it
/// lives.
class LinkFile {
  public:
    LinkFile() = default;

    /// Null when nothing is mapped.
    [[nodiscard]] printer::link::LinkLayout* get() const { return mapping_.as<printer::link::LinkLayout>(); }
    [[nodiscard]] explicit operator bool() const { return mapping_.valid(); }

    /// True while `path` still names this very object: false once the sketch was started anew, or
    /// removed it.
    [[nodiscard]] bool is_current(const std::filesystem::path& path) const;

  private:
    friend Result<LinkFile> create_link(const std::filesystem::path&, std::uint64_t);
    friend Result<LinkFile> map_link(const std::filesystem::path&);
    friend Result<LinkFile> open_link(const std::filesystem::path&);

    Result<void> open(const std::filesystem::path& path);
    Result<void> map();

    posix::Mapping mapping_;
    posix::UniqueFd descriptor_;
    std::uint64_t device_ = 0;
    std::uint64_t inode_ = 0;
};

/// Memory for one run of a sketch, all zeros, which nobody can shrink. Error: the system's.
[[nodiscard]] Result<posix::UniqueFd> make_sealed_link();
/// A sketch has made a link of that memory: who maps it now sees a complete one.
[[nodiscard]] bool is_complete_link(int descriptor);
/// The path of the inherited `descriptor`, for the three functions below.
[[nodiscard]] std::filesystem::path inherited_link(int descriptor);

/// Sketch's side: a fresh object with a random session, renamed over `path`, or in the memory that
/// `path` names (inherited_link()). The folder must exist;
/// its owner and group may open the object. Not real-time: call it before the loops start. Errors:
/// unavailable (no space), not_permitted, internal; the message names the path.
[[nodiscard]] Result<LinkFile> create_link(const std::filesystem::path& path, std::uint64_t started_unix_s);

/// Maps the link without holding it. Errors: not_found (no sketch has run), corrupt (not a link),
/// unsupported (other version or size), not_permitted.
[[nodiscard]] Result<LinkFile> map_link(const std::filesystem::path& path);

/// Service's side: maps the link and holds it. Errors: as map_link(); already_exists (another
/// service holds it).
[[nodiscard]] Result<LinkFile> open_link(const std::filesystem::path& path);

}  // namespace qduino::apps
