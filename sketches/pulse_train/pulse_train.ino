// The pulse train of sketches/listing_2, as one would write it for a real driver: pin 6 goes low
// when the sketch dies, and the tick is sent away from core 1, too. The wait is relative as there,
// so the cost of the two writes adds to every period, and the train runs a little below 10 kHz.
// sketches/pulse_train_absolute has no such drift.
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
