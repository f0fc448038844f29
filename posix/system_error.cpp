#include "posix/system_error.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

namespace qduino::posix {
namespace {

using enum ErrorCode;

constexpr std::pair<int, ErrorCode> kCodes[] = {
    {EPERM, not_permitted},     {EACCES, not_permitted},      {EROFS, not_permitted},
    {ENOENT, not_found},        {ENODEV, not_found},          {ENXIO, not_found},
    {EEXIST, already_exists},   {EADDRINUSE, already_exists}, {EBUSY, unavailable},
    {EAGAIN, unavailable},      {ENOMEM, unavailable},        {ENOSPC, unavailable},
    {EDQUOT, unavailable},      {ECONNREFUSED, unavailable},  {ETIMEDOUT, timed_out},
    {EINVAL, invalid_argument}, {ERANGE, invalid_argument},   {EOPNOTSUPP, unsupported},
    {ENOSYS, unsupported},      {ENOTTY, unsupported}};

}  // namespace

Error system_error(std::string_view what, std::string_view object, int error) {
    const auto* const known = std::ranges::find(kCodes, error, &std::pair<int, ErrorCode>::first);
    return make_error(known != std::end(kCodes) ? known->second : internal, "cannot ", what, " ", object,
                      ": ", std::strerror(error));
}

}  // namespace qduino::posix
