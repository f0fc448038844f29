// The service believes no certificate and no key but its own: what stands in their place is refused
// with its path.
#include "apps/printd/own_certificate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>

#include "tests/unit/linux/stranger.h"

namespace qduino::printd::own_certificate_test {
namespace {

namespace fs = std::filesystem;
using test::kStranger;
using test::why_no_stranger;
using ::testing::HasSubstr;

constexpr std::int64_t kNow_s = 1'790'000'000;

class Certificate : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = ::testing::TempDir() + "certificate.XXXXXX";
        state_ = ::mkdtemp(name.data());
        key_ = state_ / "tls" / "key.pem";
        shown_ = state_ / "tls" / "certificate.pem";
    }
    void TearDown() override { fs::remove_all(state_); }
    [[nodiscard]] Result<OwnCertificate> made() const {
        return own_certificate(state_, {{"printer"}, {}}, kNow_s);
    }
    /// Why there is none; empty: there is one.
    [[nodiscard]] std::string refusal() const {
        const auto own = made();
        return own ? "" : std::string{own.error().message.view()};
    }

    fs::path state_, key_, shown_;
};

TEST_F(Certificate, IsMadeOnceAndItsKeyIsKept) {
    const auto first = made(), second = made();
    ASSERT_TRUE(first.ok() && second.ok());
    EXPECT_TRUE(first->made_anew);
    EXPECT_FALSE(second->made_anew);
    EXPECT_EQ(second->identity.certificate_pem, first->identity.certificate_pem);
    std::ofstream{shown_} << "damaged";
    const auto third = made();
    ASSERT_TRUE(third.ok());
    EXPECT_TRUE(third->made_anew);
    EXPECT_EQ(third->identity.key_pem, first->identity.key_pem);
}

TEST_F(Certificate, AKeyThatIsNotItsOwnIsRefused) {
    ASSERT_EQ(refusal(), "");
    fs::rename(key_, state_ / "elsewhere");
    fs::create_symlink(state_ / "elsewhere", key_);
    EXPECT_THAT(refusal(), HasSubstr(key_.native() + " is not used: it is a symbolic link"));
    fs::remove(key_);
    fs::create_hard_link(state_ / "elsewhere", key_);
    EXPECT_THAT(refusal(), HasSubstr("second name"));
    fs::remove(key_);
    ASSERT_EQ(::mkfifo(key_.c_str(), 0600), 0);
    EXPECT_THAT(refusal(), HasSubstr("not a plain file"));
    fs::remove(key_);
    fs::rename(state_ / "elsewhere", key_);
    ASSERT_EQ(::chmod(key_.c_str(), 0640), 0);
    EXPECT_THAT(refusal(), HasSubstr("chmod 600"));
    ASSERT_EQ(::chmod(key_.c_str(), 0600), 0);
    EXPECT_EQ(refusal(), "");
    fs::resize_file(shown_, 1 << 20);
    EXPECT_THAT(refusal(), HasSubstr("more than 65536 bytes"));
}

TEST_F(Certificate, AStrangersKeyIsRefused) {
    if (!why_no_stranger().empty()) GTEST_SKIP() << why_no_stranger();
    ASSERT_EQ(refusal(), "");
    ASSERT_EQ(::chown(key_.c_str(), kStranger, kStranger), 0);
    EXPECT_THAT(refusal(), HasSubstr("belongs to another user"));
}

}  // namespace
}  // namespace qduino::printd::own_certificate_test
