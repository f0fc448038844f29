// The journal's tables, the update of an older journal, and the check whether a file is sound. For
// sqlite_store.cpp.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include "base/result.h"

namespace qduino::spool {

/// An exception of SQLite as an operating error. `corrupt`: the file is damaged, or no journal at
/// all.
[[nodiscard]] Error as_error(const SQLite::Exception& exception);

/// The first number of the first row; 0 when there is none.
[[nodiscard]] std::int64_t single_number(SQLite::Database& database, const char* query);

/// Makes the tables, or brings older ones up to date: in one transaction. Then reads every page
/// once and checks that they fit together (PRAGMA quick_check). Errors: unsupported (written by a
/// newer program; nothing is changed), corrupt. Throws SQLite's exceptions.
[[nodiscard]] Result<void> prepare_schema(SQLite::Database& database);

/// Rows that have ended. A query must use the same words as the partial index, or SQLite does not
/// use it.
inline constexpr const char* kEndedCondition = "state IN ('done','cancelled','failed')";
inline constexpr const char* kLiveCondition = "state IN ('queued','printing')";

}  // namespace qduino::spool
