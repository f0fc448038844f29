// The fiber's portable switch, on a machine that has a faster one: the same tests run over it
// (fiber_test.cpp).
#define QDUINO_FIBER_UCONTEXT 1
#include "board/sim/fiber.cpp"  // NOLINT: this variant, not the library's
