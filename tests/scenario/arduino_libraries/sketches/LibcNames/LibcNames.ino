// Names that are free on an AVR, and taken by the C library here.
const uint64_t pipe = 0xE8E8F0F0E1LL;
uint8_t clock[8] = {0x0, 0xe, 0x15, 0x17};
unsigned long time = 3, y1;
bool close = false;

struct Watch {
  int clock;
  int read() { return clock; }
};

void pause() { time++; }

void setup() {
  Serial.begin(9600);
  Watch watch;
  watch.clock = 20;
  pause();
  y1 = clock[1] + watch.read() + time;
  Serial.println(y1);
  Serial.println((unsigned long)(pipe & 0xffff), HEX);
  Serial.println(close ? "close" : "clock");
}

void loop() { delay(1000); }
