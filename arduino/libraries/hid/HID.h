/* Empty, as on every board whose processor has no USB of its own. Keyboard.h and Mouse.h have what
 * a sketch types and points with. */
#pragma once
