// Dies in the way that a letter on Serial asks for, with pins 6 and 7 off their safe levels and a
// loop on each core that keeps moving one. A small letter is for core 0, a capital one for core 1.
//
//   n  a store through a null pointer      s  a stack that is full       b  one frame beyond it
//   c  a broken contract                   d  a division by zero         f  a double fault
//   i  a non-maskable interrupt, which the other core sends; this and f on x86-64 alone

Mutex lock;

int fill(int depth) {
  volatile char room[1000];
  room[depth % 1000] = 1;
  return fill(depth + 1) + room[0];
}

// Its lowest bytes lie in the next stack.
int skip_the_guard() {
  volatile char room[200000];
  room[0] = 1;
  return room[0];
}

#ifdef __x86_64__
// Without its entry in the table a page fault cannot be told, which is a fault again.
void forget_page_faults() {
  struct __attribute__((packed)) { unsigned short limit; unsigned long long at; } table;
  asm volatile("sidt %0" : "=m"(table));
  volatile unsigned long long* gates = reinterpret_cast<volatile unsigned long long*>(table.at);
  gates[2 * 14] = 0;
}

// By the local APIC's command register, which is in memory here.
void interrupt_without_mask(unsigned core) {
  volatile unsigned* registers = reinterpret_cast<volatile unsigned*>(0xfee00000ull);
  registers[0x310 / 4] = core << 24;
  registers[0x300 / 4] = 0x4400;
}
#else
void forget_page_faults() {}
void interrupt_without_mask(unsigned) {}
#endif

volatile int order[2];  // of each core

void obey(int core) {
  volatile int* volatile nowhere = nullptr;
  volatile int one = 1, zero = 0;
  switch (order[core]) {
    case 'f': forget_page_faults();  // and then …
    case 'n': *nowhere = 1; break;
    case 's': fill(0); break;
    case 'b': skip_the_guard(); break;
    case 'c': lock.unlock(); break;
    case 'd': one = one / zero; break;
  }
}

void setup() {
  Serial.begin(115200);
  pinMode(6, OUTPUT);
  pinMode(7, OUTPUT);
  safeState(6, LOW);
  safeState(7, HIGH);
  lock.heldBy(1, 1);
}

void loop(1, 10, 100, 0) {
  digitalWrite(7, LOW);
  digitalWrite(6, HIGH);
  static bool said = false;
  if (!said) Serial.println("ready");
  said = true;
  const int letter = Serial.read();
  if (letter > 0) order[letter < 'a'] = letter | 0x20;
  obey(0);
  if (order[1] == 'i') interrupt_without_mask(1);
  waitForNextPeriod();
}

void loop(2, 100, 100, 1) {
  digitalWrite(6, HIGH);
  obey(1);
  if (order[0] == 'i') interrupt_without_mask(0);
  delayMicroseconds(50);
}
