#include "posix/mapping.h"

#include <sys/mman.h>

#include "posix/system_error.h"

namespace qduino::posix {
namespace {

void* map(std::size_t bytes, int flags, int fd, std::size_t offset) {
    return ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | flags, fd, static_cast<off_t>(offset));
}

}  // namespace

Mapping::~Mapping() {
    if (address_) ::munmap(address_, bytes_);
}

Result<Mapping> map_shared(int fd, std::size_t offset, std::size_t bytes, bool populate) {
    void* address = map(bytes, populate ? MAP_POPULATE : 0, fd, offset);
    if (address == MAP_FAILED) return system_error("map", "shared memory");
    return Mapping{address, bytes};
}

Result<Mapping> map_read_only(int fd, std::size_t bytes) {
    void* address = ::mmap(nullptr, bytes, PROT_READ, MAP_SHARED | MAP_POPULATE, fd, 0);
    if (address == MAP_FAILED) return system_error("map", "shared memory");
    return Mapping{address, bytes};
}

Result<Mapping> map_anonymous(std::size_t bytes) {
    void* address = map(bytes, MAP_ANONYMOUS | MAP_POPULATE, -1, 0);
    if (address == MAP_FAILED) return system_error("map", "memory for child processes");
    return Mapping{address, bytes};
}

}  // namespace qduino::posix
