// The service's own certificate: what it names, when it is made anew.
#include "web/net/certificate.h"

#include <gtest/gtest.h>

#include "web/net/tls.h"

namespace qduino::web::certificate_test {
namespace {

constexpr std::int64_t kNow_s = 1'795'000'000, kDay_s = 24 * 3600;

TEST(Certificate, NamesWhatItShouldAndIsRenewedBeforeItEnds) {
    const std::string key = make_private_key().value(), other_key = make_private_key().value();
    const CertificateNames names{{"printer", "printer.local", "not a name"}, {"192.168.1.5", "fd00::5", "x"}};
    const std::string made = make_certificate(key, names, kNow_s).value();
    EXPECT_TRUE(TlsContext::make({made, key}).ok());
    EXPECT_TRUE(is_certificate_good(made, key, names, kNow_s));
    EXPECT_TRUE(is_certificate_good(made, key, {{"printer"}, {}}, kNow_s)) << "more than is needed";
    EXPECT_FALSE(is_certificate_good(made, key, {{"printer2.local"}, {}}, kNow_s));
    EXPECT_FALSE(is_certificate_good(made, key, {{}, {"192.168.1.6"}}, kNow_s));
    EXPECT_FALSE(is_certificate_good(made, other_key, names, kNow_s));
    EXPECT_FALSE(is_certificate_good("", key, names, kNow_s));
    EXPECT_FALSE(is_certificate_good(made, "", names, kNow_s));
    EXPECT_TRUE(is_certificate_good(made, key, names,
                                    kNow_s + (kCertificateDays - kCertificateRenewDays - 1) * kDay_s));
    EXPECT_FALSE(is_certificate_good(made, key, names,
                                     kNow_s + (kCertificateDays - kCertificateRenewDays + 1) * kDay_s));
    EXPECT_FALSE(is_certificate_good(made, key, names, kNow_s - 2 * kDay_s))
        << "the clock was wrong when it was made";
}

TEST(Certificate, EachHasAFingerprintOfItsOwn) {
    const std::string key = make_private_key().value();
    const std::string one = make_certificate(key, {{"a"}, {}}, kNow_s).value();
    const std::string two = make_certificate(key, {{"a"}, {}}, kNow_s).value();
    EXPECT_EQ(fingerprint_of(one).size(), 32u * 3 - 1);
    EXPECT_NE(fingerprint_of(one), fingerprint_of(two));
    EXPECT_EQ(fingerprint_of(key), "");
}

TEST(Certificate, AGivenOneMustBeWholeAndFitItsKey) {
    const std::string key = make_private_key().value(), other_key = make_private_key().value();
    const std::string made = make_certificate(key, {{"a"}, {}}, kNow_s).value();
    for (const TlsIdentity& bad :
         {TlsIdentity{"", key}, TlsIdentity{made, ""}, TlsIdentity{made, other_key}, TlsIdentity{key, key},
          TlsIdentity{made, made}, TlsIdentity{"-----BEGIN", key}}) {
        const auto context = TlsContext::make(bad);
        ASSERT_FALSE(context.ok());
        EXPECT_EQ(context.error().code, ErrorCode::invalid_argument);
    }
}

TEST(HostName, IsLettersDigitsHyphensAndDots) {
    for (const char* good : {"printer", "printer-2", "print.example.org", "2nd"})
        EXPECT_TRUE(is_host_name(good));
    for (const char* bad : {"", ".", "a.", ".a", "a..b", "-a", "a-", "a b", "a_b", "a,IP:1.2.3.4", "ä"})
        EXPECT_FALSE(is_host_name(bad)) << bad;
    EXPECT_FALSE(is_host_name(std::string(64, 'a')));
}

}  // namespace
}  // namespace qduino::web::certificate_test
