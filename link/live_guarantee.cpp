#include "link/live_guarantee.h"

#include <string>
#include <string_view>

#include "report/guarantee_report.h"
#include "report/sketch_report.h"

namespace qduino::apps {

void publish_guarantee(printer::link::LinkLayout& link, runtime::Runtime& runtime) {
    printer::link::GuaranteeText text;
    const std::string json = guarantee_json(guarantee_of(runtime));
    if (json.size() > decltype(text.json)::kCapacity) return;
    text.json.assign(json);
    link.guarantee.write(text);
}

/// Once a stop is asked for nothing is published any more: run() forces the safe states.
void run_and_publish(printer::link::LinkLayout& link, runtime::Runtime& runtime) {
    while (!runtime.board().stop_requested()) {
        publish_guarantee(link, runtime);
        runtime.run(runtime.board().now() + kGuaranteeEvery);
    }
    runtime.run(kForever);
}

}  // namespace qduino::apps
