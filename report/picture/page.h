// A schedule as a page of SVG: a Gantt chart of each core on one axis of time, the pins as a logic
// analyser shows them, and below it R against T of each loop.
//
//   core 0        ▲            ▲            ▲          ▲ release   △ ended in time   ✕ missed
//   loop 3        ██           ██           ██         █ runs: dark as high as its budget is left
//   loop 1          ████░░░░     ████░░░░              ░ throttled
//   pin 13        ▔▔▔▔▔▔▔▔▔▔▔▔▔▁▁▁▁▁▁▁▁▁▁▁▁▁
//                 0      50 ms     100 ms
//
// A row with more stretches than fit is drawn as shares: how much of each point of the axis the
// VCPU ran, was throttled and waited. So the size of the page is bounded: about 2 MB at worst.
// Colours are those of M. Okabe and K. Ito, "Color Universal Design" (2008), which colour-blind
// people can tell apart; no meaning hangs on a colour alone. The style sheet has a dark form, too,
// for readers who prefer that (Media Queries Level 5, prefers-color-scheme).
#pragma once

#include <string>

#include "report/picture/schedule.h"

namespace qduino::apps::picture {

/// The page. The root has data-from-ns, data-until-ns, data-x and data-width: where the axis
/// begins, ends, and lies. A VCPU's group has data-vcpu and data-core.
[[nodiscard]] std::string svg_page(const Schedule& schedule);

}  // namespace qduino::apps::picture
