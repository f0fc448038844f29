#include "posix/owner.h"

#include <sys/stat.h>
#include <unistd.h>

namespace qduino::posix {

void give_to_owner_of_folder(const std::filesystem::path& path, int descriptor) {
    struct stat folder {};
    const std::filesystem::path parent = path.has_parent_path() ? path.parent_path() : ".";
    if (::geteuid() != 0 || ::stat(parent.c_str(), &folder) != 0) return;
    const int given = descriptor >= 0 ? ::fchown(descriptor, folder.st_uid, folder.st_gid)
                                      : ::lchown(path.c_str(), folder.st_uid, folder.st_gid);
    static_cast<void>(given);
}

}  // namespace qduino::posix
