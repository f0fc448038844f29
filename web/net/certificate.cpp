#include "web/net/certificate.h"

#include <openssl/bn.h>
#include <openssl/ec.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <memory>

#include "base/text.h"
#include "web/http/forwarded.h"
#include "web/http/http.h"

namespace qduino::web {

namespace {

template <auto kFree>
struct FreeWith {
    template <typename T>
    void operator()(T* object) const {
        kFree(object);
    }
};
using Certificate = std::unique_ptr<X509, FreeWith<X509_free>>;
using PrivateKey = std::unique_ptr<EVP_PKEY, FreeWith<EVP_PKEY_free>>;
using TextBio = std::unique_ptr<BIO, FreeWith<BIO_free>>;

constexpr std::int64_t kDay_s = 24 * 3600;

TextBio text_of(const std::string& pem) {
    return TextBio{BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()))};
}
std::string text_in(BIO* bio) {
    char* bytes = nullptr;
    const long count = BIO_get_mem_data(bio, &bytes);
    return count > 0 ? std::string(bytes, static_cast<std::size_t>(count)) : std::string{};
}
Certificate certificate_in(const std::string& pem) {
    const TextBio bio = text_of(pem);
    return Certificate{PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr)};
}
PrivateKey key_in(const std::string& pem) {
    const TextBio bio = text_of(pem);
    return PrivateKey{PEM_read_bio_PrivateKey(bio.get(), nullptr, nullptr, nullptr)};
}

/// "DNS:printer.local,IP:192.168.1.5": what OpenSSL makes the extension of.
std::string alternative_names(const CertificateNames& names) {
    std::string list;
    const auto add = [&list](const char* kind, const std::string& value) {
        write(list, list.empty() ? "" : ",", kind, value);
    };
    for (const std::string& name : names.names)
        if (is_host_name(name)) add("DNS:", name);
    for (const std::string& address : names.addresses)
        if (is_numeric_address(address)) add("IP:", address);
    return list;
}

bool extend(X509* certificate, int kind, const std::string& value) {
    X509V3_CTX context;
    X509V3_set_ctx_nodb(&context);
    X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
    X509_EXTENSION* made = X509V3_EXT_conf_nid(nullptr, &context, kind, value.c_str());
    const bool added = made && X509_add_ext(certificate, made, -1) == 1;
    X509_EXTENSION_free(made);
    return added;
}

/// A serial number of 127 random bits: the same issuer never gives one twice.
bool number(X509* certificate) {
    std::array<unsigned char, 16> bytes{};
    if (RAND_bytes(bytes.data(), bytes.size()) != 1) return false;
    bytes.front() &= 0x7f;
    BIGNUM* big = BN_bin2bn(bytes.data(), bytes.size(), nullptr);
    const bool done = big && BN_to_ASN1_INTEGER(big, X509_get_serialNumber(certificate)) != nullptr;
    BN_free(big);
    return done;
}

bool fill(X509* certificate, EVP_PKEY* key, const CertificateNames& names, std::int64_t now_s) {
    constexpr std::size_t kCommonNameMax = 64;  // RFC 5280, upper bounds
    std::string common = names.names.empty() ? "QduinoMC printer" : names.names.front();
    common.resize(std::min(common.size(), kCommonNameMax));
    X509_NAME* subject = X509_get_subject_name(certificate);
    const auto* bytes = reinterpret_cast<const unsigned char*>(common.data());
    return X509_set_version(certificate, X509_VERSION_3) == 1 && number(certificate) &&
           ASN1_TIME_set(X509_getm_notBefore(certificate), now_s - kDay_s) != nullptr &&
           ASN1_TIME_set(X509_getm_notAfter(certificate), now_s + kCertificateDays * kDay_s) != nullptr &&
           X509_set_pubkey(certificate, key) == 1 &&
           X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, bytes, static_cast<int>(common.size()),
                                      -1, 0) == 1 &&
           X509_set_issuer_name(certificate, subject) == 1 &&
           extend(certificate, NID_basic_constraints, "critical,CA:FALSE") &&
           extend(certificate, NID_key_usage, "critical,digitalSignature") &&
           extend(certificate, NID_ext_key_usage, "serverAuth") &&
           extend(certificate, NID_subject_key_identifier, "hash") &&
           extend(certificate, NID_subject_alt_name, alternative_names(names)) &&
           X509_sign(certificate, key, EVP_sha256()) > 0;
}

bool names_all(X509* certificate, const CertificateNames& wanted) {
    const auto has_name = [&](const std::string& name) {
        return !is_host_name(name) ||
               X509_check_host(certificate, name.c_str(), name.size(), 0, nullptr) == 1;
    };
    const auto has_address = [&](const std::string& address) {
        return !is_numeric_address(address) || X509_check_ip_asc(certificate, address.c_str(), 0) == 1;
    };
    return std::ranges::all_of(wanted.names, has_name) && std::ranges::all_of(wanted.addresses, has_address);
}

}  // namespace

bool is_host_name(std::string_view text) {
    constexpr std::size_t kNameMax = 253, kLabelMax = 63;  // RFC 1035 §2.3.4
    if (text.empty() || text.size() > kNameMax || text.ends_with('.')) return false;
    while (!text.empty()) {
        const std::string_view label = take_until(text, '.');
        const bool plain =
            std::ranges::all_of(label, [](char c) { return is_letter_or_digit(c) || c == '-'; });
        if (!plain || label.empty() || label.size() > kLabelMax || label.starts_with('-') ||
            label.ends_with('-'))
            return false;
    }
    return true;
}

Result<std::string> make_private_key() {
    const PrivateKey key{EVP_EC_gen("P-256")};
    const TextBio bio{BIO_new(BIO_s_mem())};
    if (!key || !bio ||
        PEM_write_bio_PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr) != 1) {
        ERR_clear_error();
        return make_error(ErrorCode::internal, "OpenSSL could not make a private key");
    }
    return text_in(bio.get());
}

Result<std::string> make_certificate(const std::string& key_pem, const CertificateNames& names,
                                     std::int64_t now_s) {
    const PrivateKey key = key_in(key_pem);
    if (!key) return make_error(ErrorCode::invalid_argument, "this is no private key in PEM form");
    const Certificate certificate{X509_new()};
    const TextBio bio{BIO_new(BIO_s_mem())};
    if (!certificate || !bio || !fill(certificate.get(), key.get(), names, now_s) ||
        PEM_write_bio_X509(bio.get(), certificate.get()) != 1) {
        ERR_clear_error();
        return make_error(ErrorCode::internal, "OpenSSL could not make a certificate");
    }
    return text_in(bio.get());
}

bool is_certificate_good(const std::string& certificate_pem, const std::string& key_pem,
                         const CertificateNames& names, std::int64_t now_s) {
    const Certificate certificate = certificate_in(certificate_pem);
    const PrivateKey key = key_in(key_pem);
    bool good = certificate && key && X509_check_private_key(certificate.get(), key.get()) == 1;
    if (good) {
        std::time_t now = now_s, soon = now_s + kCertificateRenewDays * kDay_s;
        good = X509_cmp_time(X509_get0_notBefore(certificate.get()), &now) < 0 &&
               X509_cmp_time(X509_get0_notAfter(certificate.get()), &soon) > 0 &&
               names_all(certificate.get(), names);
    }
    ERR_clear_error();
    return good;
}

std::string fingerprint_of(const std::string& certificate_pem) {
    const Certificate certificate = certificate_in(certificate_pem);
    std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
    unsigned int count = 0;
    const bool done = certificate && X509_digest(certificate.get(), EVP_sha256(), digest.data(), &count) == 1;
    ERR_clear_error();
    constexpr std::string_view kDigits = "0123456789ABCDEF";
    std::string words;
    for (unsigned int i = 0; done && i < count; ++i) {
        if (i > 0) words += ':';
        words += kDigits[digest[i] >> 4];
        words += kDigits[digest[i] & 15];
    }
    return words;
}

}  // namespace qduino::web
