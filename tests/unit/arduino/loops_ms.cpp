// A sketch without TIME_UNIT: plain numbers are milliseconds. And every other use of the word that
// must go on working.
#include <Arduino.h>

namespace {

/// As the clients of many libraries: loop() is a method.
struct Client2 {
    int calls = 0;
    void loop() { ++calls; }
    void loop(int times) { calls += times; }
    int loop(int a, int b) { return a + b; }
};

constexpr int kFastLoop = 7;
constexpr int kCore = 1;

}  // namespace

int loop_bodies_run = 0;
Client2 client;

void loop(3, 30, 100) { ++loop_bodies_run; }

void loop(kFastLoop, 10us, 100us, kCore) {
    client.loop();
    client.loop(3);
    loop_bodies_run += client.loop(1, 2);
}
void loop(2 + 2, 0.5, 8, 0) { ++loop_bodies_run; }

void setup() {}
void loop(void) { ++loop_bodies_run; }

QDUINO_SKETCH(&setup, &loop);

int calls_of_client() { return client.calls; }
