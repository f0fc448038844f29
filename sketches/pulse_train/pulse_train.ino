// A 10 kHz pulse train, after Listing 2 of the paper (Cheng, West, Ye, RTAS 2017, section III.C).
//
// The exact text of Listing 2 was not at hand when this was written. It is put together from the
// calls that the paper names for it (a loop that owns a core, noInterrupts, noTimer,
// delayBusyNanoseconds, digitalWrite) around the body of its Listing 1: wait 100 us, write 1, write
// 0, for ever. The wait is relative, so the cost of the two writes adds to every period, and the
// train runs a little below 10 kHz. delayBusyUntil() makes one without drift.
//
//   pin 6  _|‾|____________________|‾|____________________|‾|___
//          write  100 µs of spin   write

TIME_UNIT(us);

void setup() {
  pinMode(6, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
}

void loop(1, 100, 100, 1) {
  delayBusyNanoseconds(100000);
  digitalWrite(6, HIGH);
  digitalWrite(6, LOW);
}
