#include "TimerUser.h"

#include <MsTimer2.h>
#include <TimerOne.h>

static volatile unsigned fast_count = 0, slow_count = 0;

static void onFast() { fast_count++; }
static void onSlow() { slow_count++; }

void TimerUser::begin() {
    Timer1.initialize(2000);
    Timer1.attachInterrupt(onFast);
    Timer1.pwm(9, 512);
    MsTimer2::set(50, onSlow);
    MsTimer2::start();
}
unsigned TimerUser::fast() { return fast_count; }
unsigned TimerUser::slow() { return slow_count; }
