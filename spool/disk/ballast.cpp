#include "spool/disk/ballast.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "posix/guarded_file.h"

namespace qduino::spool {

Ballast::Ballast(const std::filesystem::path& folder) : file_(folder / "ballast") { make(); }

void Ballast::make() {
    const auto file = posix::open_or_make_guarded(file_, 0600);
    struct stat found {};
    if (!file || ::fstat(file->get(), &found) != 0) return;
    // Blocks that are taken, and not only a size. What is there already is asked for again.
    const bool whole = ::posix_fallocate(file->get(), 0, static_cast<off_t>(kBytes)) == 0;
    if (!whole) ::unlink(file_.c_str());
    held_ = whole;
}

bool Ballast::give_up() {
    if (!held_.exchange(false)) return false;
    return ::unlink(file_.c_str()) == 0;
}

void Ballast::keep(Instant now) {
    if (held() || now - tried_ < kTryEvery) return;
    tried_ = now;
    make();
}

}  // namespace qduino::spool
