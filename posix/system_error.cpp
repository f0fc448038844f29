#include "posix/system_error.h"

#include <cstring>

namespace qduino::posix {
namespace {

ErrorCode code_of(int error) {
    switch (error) {
        case EPERM:
        case EACCES:
        case EROFS:
            return ErrorCode::not_permitted;
        case ENOENT:
        case ENODEV:
        case ENXIO:
            return ErrorCode::not_found;
        case EEXIST:
        case EADDRINUSE:
            return ErrorCode::already_exists;
        case EBUSY:
        case EAGAIN:
        case ENOMEM:
        case ENOSPC:
        case EDQUOT:
        case ECONNREFUSED:
            return ErrorCode::unavailable;
        case ETIMEDOUT:
            return ErrorCode::timed_out;
        case EINVAL:
        case ERANGE:
            return ErrorCode::invalid_argument;
        case EOPNOTSUPP:
        case ENOSYS:
        case ENOTTY:
            return ErrorCode::unsupported;
        default:
            return ErrorCode::internal;
    }
}

}  // namespace

Error system_error(std::string_view what, std::string_view object, int error) {
    Error result{code_of(error), "cannot "};
    result.message.append(what).append(" ").append(object).append(": ").append(std::strerror(error));
    return result;
}

}  // namespace qduino::posix
