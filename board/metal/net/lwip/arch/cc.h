// What lwIP asks of its surroundings (its doc/sys_arch.txt); net/network.cpp has the bodies.
#pragma once

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif
__attribute__((noreturn)) void lwip_failed(const char* what);
uint32_t lwip_random(void);
#ifdef __cplusplus
}
#endif

#define LWIP_NO_CTYPE_H 1
#define LWIP_RAND() lwip_random()
#define LWIP_PLATFORM_DIAG(words) ((void)0)
#define LWIP_PLATFORM_ASSERT(what) lwip_failed(what)
