// The parameters of the list of jobs: whatever stands behind the `?`, what comes out is in range,
// and a page can be read with it.
//
// Input: the query, not decoded.
#include <cstdint>
#include <string_view>

#include "spool/name_search.h"
#include "tests/fuzz/gcode/fuzz_check.h"
#include "web/api/json.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace qduino;
    const std::string_view text{reinterpret_cast<const char*>(data), size};
    const Result<spool::JobQuery> query = web::api::job_query_of(text, "printing");
    if (!query.ok()) {
        FUZZ_EXPECT(!query.error().message.empty());
        return 0;
    }
    FUZZ_EXPECT(query->limit >= 1 && query->limit <= spool::JobQuery::kLimitMax);
    FUZZ_EXPECT(!query->before || *query->before > 0);
    FUZZ_EXPECT(spool::is_utf8(query->text) && query->text.size() <= 200);
    const std::string folded = spool::folded(query->text);
    FUZZ_EXPECT(spool::is_utf8(folded) && spool::folded(folded) == folded &&
                spool::name_holds(query->text, folded));
    return 0;
}
