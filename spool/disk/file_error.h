// What a person reads when the files of jobs fail: a full disk says what to do about it.
#pragma once

#include "posix/system_error.h"

namespace qduino::spool {

/// unavailable (disk full), not_permitted, or internal.
[[nodiscard]] inline Error file_error(const Error& failed) {
    if (failed.code == ErrorCode::unavailable) {
        return make_error(ErrorCode::unavailable,
                          "the disk is full; delete finished jobs or free some space");
    }
    return make_error(failed.code == ErrorCode::not_permitted ? failed.code : ErrorCode::internal,
                      "job files: ", failed.message);
}

/// The same for an errno: "job files: cannot WHAT OBJECT: REASON".
[[nodiscard]] inline Error file_error(std::string_view what, std::string_view object, int number) {
    return file_error(posix::system_error(what, object, number));
}

}  // namespace qduino::spool
