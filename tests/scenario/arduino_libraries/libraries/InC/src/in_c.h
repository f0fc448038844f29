#pragma once
#ifdef __cplusplus
extern "C" {
#endif
unsigned long blink_in_c(int pin);
#ifdef __cplusplus
}
#endif
