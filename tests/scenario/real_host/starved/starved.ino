// Loop 2 does not end when another task has core 1 for itself; loop 1 does.
void setup() {}

void loop(1, 10, 40, 0) { waitForNextPeriod(); }

void loop(2, 1, 5, 1) { waitForNextPeriod(); }
