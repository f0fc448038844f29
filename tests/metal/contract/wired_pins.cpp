// The pins of the board (board/metal/pins.cpp) as they are, but for one instruction: the `out` that
// leaves the machine ends at the wires of the contract (contract_image.cpp).
#include "board/metal/machine/instructions.h"
#include "tests/metal/contract/wires.h"

#define port_write write_to_wires
#include "board/metal/pins.cpp"
