#include "apps/printd/own_certificate.h"

#include <fcntl.h>
#include <sys/stat.h>

#include "posix/durable_file.h"
#include "posix/guarded_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"

namespace qduino::printd {

namespace {

constexpr std::size_t kFileMax = 64 * 1024;

/// A file of the service's own; empty when there is none. One of another user is none of its own,
/// and a link may lead to anything: neither is believed.
Result<std::string> read_own(const std::filesystem::path& path, bool secret) {
    const Result<posix::UniqueFd> file = posix::open_guarded(path, O_RDONLY);
    if (!file && file.error().code == ErrorCode::not_found) return std::string{};
    if (!file) return file.error();
    struct stat found {};
    if (::fstat(file->get(), &found) != 0) return posix::system_error("look at", path.native());
    if (secret && (found.st_mode & 077) != 0)
        return make_error(ErrorCode::not_permitted, "others may read the private key; chmod 600 ",
                          path.native());
    return posix::read_at_most(file->get(), kFileMax, path);
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
