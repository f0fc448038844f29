#include "web/net/key_file.h"

#include <fcntl.h>
#include <sodium/randombytes.h>
#include <sodium/utils.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>

#include "posix/durable_file.h"
#include "posix/small_file.h"
#include "posix/system_error.h"
#include "posix/unique_fd.h"
#include "web/authentication.h"

namespace qduino::web {

namespace {

constexpr std::size_t kTokenBytes = 32;

Result<std::string> make_key(const std::filesystem::path& file) {
    const std::string key = random_token();
    QDUINO_TRY(posix::write_durably(file, key + "\n"));
    return key;
}

}  // namespace

std::string random_token() {
    std::array<unsigned char, kTokenBytes> bytes{};
    randombytes_buf(bytes.data(), bytes.size());
    std::array<char, kTokenLength + 1> text{};
    sodium_bin2base64(text.data(), text.size(), bytes.data(), bytes.size(),
                      sodium_base64_VARIANT_URLSAFE_NO_PADDING);
    return text.data();
}

Result<std::string> load_or_make_key(const std::filesystem::path& file) {
    const posix::UniqueFd opened{::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW)};
    if (!opened.valid() && errno == ENOENT) return make_key(file);
    if (!opened.valid()) return posix::system_error("open the key file", file.native());
    struct stat found {};
    if (::fstat(opened.get(), &found) != 0) return posix::system_error("look at the key file", file.native());
    QDUINO_TRY_ASSIGN(std::string key, posix::read_to_end(opened.get(), file.native()));
    if ((found.st_mode & 077) != 0) {
        return make_error(ErrorCode::not_permitted, "others may read the key file; chmod 600 ",
                          file.native());
    }
    while (!key.empty() && (key.back() == '\n' || key.back() == '\r')) key.pop_back();
    if (key.size() < 16) {
        return make_error(ErrorCode::corrupt,
                          "the key file holds no key of at least 16 characters; delete it to have one made: ",
                          file.native());
    }
    return key;
}

}  // namespace qduino::web
