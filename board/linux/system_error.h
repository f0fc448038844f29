// The error of a system call as a project Error: what was attempted, on what, and what the kernel said.
#pragma once

#include <cerrno>
#include <cstring>
#include <string_view>

#include "base/result.h"

namespace qduino::board::linux {

/// `what` reads as an attempt ("open"), `object` names the file. Call at once after the failure: it reads
/// errno by default.
inline Error system_error(std::string_view what, std::string_view object, int error = errno) {
    Error result;
    switch (error) {
        case EPERM:
        case EACCES:
            result.code = ErrorCode::not_permitted;
            break;
        case ENOENT:
        case ENODEV:
        case ENXIO:
            result.code = ErrorCode::not_found;
            break;
        case EEXIST:
            result.code = ErrorCode::already_exists;
            break;
        case EBUSY:
        case EAGAIN:
        case ENOMEM:
        case ENOSPC:
            result.code = ErrorCode::unavailable;
            break;
        case ETIMEDOUT:
            result.code = ErrorCode::timed_out;
            break;
        case EINVAL:
        case ERANGE:
            result.code = ErrorCode::invalid_argument;
            break;
        case EOPNOTSUPP:
        case ENOSYS:
        case ENOTTY:
            result.code = ErrorCode::unsupported;
            break;
        default:
            result.code = ErrorCode::internal;
            break;
    }
    result.message.append("cannot ").append(what).append(" ").append(object).append(": ");
    result.message.append(std::strerror(error));
    return result;
}

}  // namespace qduino::board::linux
