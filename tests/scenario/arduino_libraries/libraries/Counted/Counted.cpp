#include "Counted.h"

static volatile unsigned up_count = 0, once_count = 0, total = 0;

void Counted::up() { up_count = up_count + 1; }
void Counted::once() { once_count = once_count + 1; }
void Counted::by(unsigned int step) { total = total + step; }
unsigned Counted::ups() { return up_count; }
unsigned Counted::onces() { return once_count; }
unsigned Counted::sum() { return total; }
