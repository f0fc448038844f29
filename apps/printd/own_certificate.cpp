#include "apps/printd/own_certificate.h"

#include <fcntl.h>
#include <sys/stat.h>

#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::printd {

namespace {

constexpr std::size_t kFileMax = 64 * 1024;

/// A file of the service's own; empty when there is none, or it is too large to be one.
Result<std::string> read_own(const std::filesystem::path& path, bool secret) {
    const posix::UniqueFd file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK)};
    if (!file.valid() && errno == ENOENT) return std::string{};
    struct stat found {};
    if (!file.valid() || ::fstat(file.get(), &found) != 0) return posix::system_error("open", path.native());
    if (secret && (found.st_mode & 077) != 0)
        return make_error(ErrorCode::not_permitted, "others may read the private key; chmod 600 ",
                          path.native());
    if (!S_ISREG(found.st_mode) || static_cast<std::size_t>(found.st_size) > kFileMax) return std::string{};
    return posix::read_to_end(file.get(), path.native());
}

}  // namespace

Result<OwnCertificate> own_certificate(const std::filesystem::path& state, const web::CertificateNames& names,
                                       std::int64_t now_s) {
    const std::filesystem::path folder = state / "tls";
    if (::mkdir(folder.c_str(), 0700) != 0 && errno != EEXIST)
        return posix::system_error("make", folder.native());
    OwnCertificate own;
    QDUINO_TRY_ASSIGN(own.identity.key_pem, read_own(folder / "key.pem", true));
    QDUINO_TRY_ASSIGN(own.identity.certificate_pem, read_own(folder / "certificate.pem", false));
    if (web::is_certificate_good(own.identity.certificate_pem, own.identity.key_pem, names, now_s))
        return own;
    own.made_anew = true;
    Result<std::string> made = web::make_certificate(own.identity.key_pem, names, now_s);
    if (!made) {  // there was no key, or a damaged one
        QDUINO_TRY_ASSIGN(own.identity.key_pem, web::make_private_key());
        QDUINO_TRY(posix::write_durably(folder / "key.pem", own.identity.key_pem, 0600));
        made = web::make_certificate(own.identity.key_pem, names, now_s);
    }
    QDUINO_TRY_ASSIGN(own.identity.certificate_pem, std::move(made));
    QDUINO_TRY(posix::write_durably(folder / "certificate.pem", own.identity.certificate_pem, 0600));
    QDUINO_TRY(posix::sync_to_disk(folder));
    return own;
}

}  // namespace qduino::printd
