#include "runtime/sketch.h"

namespace qduino::runtime {

SketchTable& sketch_table() {
    // Loops register themselves from static initialisers, in any order: made at the first use.
    static SketchTable table;
    return table;
}

}  // namespace qduino::runtime
