#include "board/linux/pin/starter.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/text.h"
#include "posix/system_error.h"

namespace qduino::board::linux {
namespace {

using Word = std::atomic<std::uint32_t>;

}  // namespace

Result<void> StarterLife::begin() {
    memory_.reset(::memfd_create("starter", MFD_CLOEXEC | MFD_ALLOW_SEALING));
    if (!memory_.valid() || ::ftruncate(memory_.get(), sizeof(Word)) != 0)
        return posix::system_error("make", "a word in memory");
    // A page that is cut off would kill the supervisor.
    ::fcntl(memory_.get(), F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL);
    QDUINO_TRY_ASSIGN(mapping_, posix::map_shared(memory_.get(), 0, sizeof(Word), true));
    witness_.call(*mapping_.as<Word>(), true);
    return {};
}

std::string StarterLife::path() const { return text<std::string>("/proc/self/fd/", memory_.get()); }

void StarterLife::hand_on() const { ::fcntl(memory_.get(), F_SETFD, 0); }

Result<Starter> Starter::open(const std::string& path) {
    const posix::UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC)};
    if (!file.valid()) return posix::system_error("open", path);
    QDUINO_TRY_ASSIGN(posix::Mapping mapping, posix::map_read_only(file.get(), sizeof(Word)));
    return Starter{std::move(mapping)};
}

}  // namespace qduino::board::linux
