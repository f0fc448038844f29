// Sets of loops that no board may take, one on each core:
//
//   core 0   the lower loop holds the lock for longer than the higher one's period leaves
//   core 1   a loop that may hold a lock for its whole budget, above one that leaves it no more
//   core 2   a chain: 4 waits for 5, which waits for 6
//   core 3   budgets that are too large together

TIME_UNIT(us);

Mutex first, second, third, fourth;

void setup() {
  using namespace std::chrono_literals;
  first.heldBy(1, 1ms);
  first.heldBy(2, 9ms);
  second.heldBy(3, 4ms);
  third.heldBy(4, 1ms);
  third.heldBy(5, 5ms);
  fourth.heldBy(5, 5ms);
  fourth.heldBy(6, 9ms);
}

void loop(1, 2000, 10000, 0) { waitForNextPeriod(); }
void loop(2, 20000, 100000, 0) { waitForNextPeriod(); }

void loop(3, 4000, 10000, 1) { waitForNextPeriod(); }
void loop(7, 13000, 20000, 1) { waitForNextPeriod(); }

void loop(4, 2000, 12000, 2) { waitForNextPeriod(); }
void loop(5, 6000, 35000, 2) { waitForNextPeriod(); }
void loop(6, 40000, 100000, 2) { waitForNextPeriod(); }

void loop(8, 60000, 100000, 3) { waitForNextPeriod(); }
void loop(9, 60000, 150000, 3) { waitForNextPeriod(); }
