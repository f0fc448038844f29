// The certificate that the service makes for itself, in its state folder.
//
//   DIR/tls/key.pem          made once (0600): who has accepted it need not know a new one
//   DIR/tls/certificate.pem  made anew 60 days before it ends, when the clock was wrong, or when
//                            the printer has another name or address
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "web/net/certificate.h"
#include "web/net/tls.h"

namespace qduino::printd {

struct OwnCertificate {
    web::TlsIdentity identity;
    bool made_anew = false;
};

/// As the user of the service. `now_s`: Unix time. Errors: not_permitted (others may read the key),
/// internal.
[[nodiscard]] Result<OwnCertificate> own_certificate(const std::filesystem::path& state,
                                                     const web::CertificateNames& names, std::int64_t now_s);

}  // namespace qduino::printd
