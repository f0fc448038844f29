// C++'s placement new, by the name that an Arduino core gives it.
#pragma once

#include <new>
