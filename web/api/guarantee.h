// The guarantee report that the sketch publishes (report/guarantee_report.h has its form),
// checked before anybody reads it.
//
// The sketch is another process, possibly of another build, possibly dying, so its text may be
// anything. What passes is an object of plain values and of tables; a table is an array of rows,
// and a row has plain values alone. Whatever the page reads of a row is there, and is what the page
// takes it for.
#pragma once

#include <optional>
#include <string_view>

#include "web/api/json.h"

namespace qduino::web::api {

/// The most rows that a table of the report has.
inline constexpr std::size_t kGuaranteeRows = 64;

/// The report as it is handed on; nothing when `text` is none.
[[nodiscard]] std::optional<Json> checked_guarantee(std::string_view text);

}  // namespace qduino::web::api
