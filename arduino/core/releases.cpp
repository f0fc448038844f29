#include "arduino/core/releases.h"

#include "arduino/core/constants.h"
#include "arduino/core/diagnostics.h"

bool safeState(int pin, int level) {
    using namespace qduino;
    if (pin < 0 || pin >= board::kPinCount) {
        arduino::report_error("safeState", pin,
                              make_error(ErrorCode::invalid_argument, "no such pin: the board has 0 to 127"));
        return false;
    }
    const board::PinId id{static_cast<std::uint16_t>(pin)};
    return arduino::succeeded(
        "safeState", pin,
        board::current().safe_state(id, level == LOW ? board::Level::low : board::Level::high));
}
