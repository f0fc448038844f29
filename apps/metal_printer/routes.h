// What the printer without a system answers: those routes of docs/api.md that make sense without a
// disk and without accounts, with the same paths and the same JSON.
#pragma once

#include <string>

#include "apps/metal_printer/memory_spool.h"
#include "web/http/http.h"

namespace qduino::apps::metal {

/// The request is an upload: its body goes to a MemoryUpload with this name; nothing: it is not.
[[nodiscard]] std::optional<std::string> upload_name_of(const web::RequestHead& head);

/// The job that an upload has become, or why it has not.
[[nodiscard]] web::Response answer_upload(MemorySpool& spool, Result<Uploaded> upload);

/// The answer to any other request.
[[nodiscard]] web::Response answer(MemorySpool& spool, const web::RequestHead& head);

}  // namespace qduino::apps::metal
