// The pins of a parallel port: each output rises and falls alone, in the connector's order, while
// those before it stay as they were; and what comes in is told.

constexpr int kOutputs[] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 14, 16, 17};
constexpr int kInputs[] = {10, 11, 12, 13, 15};

void setup() {
  Serial.begin(115200);
  for (int pin : kOutputs) pinMode(pin, OUTPUT);
  for (int pin : kInputs) pinMode(pin, INPUT);
  safeState(9, HIGH);
  for (int pin : kOutputs) digitalWrite(pin, HIGH);
  for (int pin : kOutputs) digitalWrite(pin, LOW);
  for (int pin : kInputs) {
    Serial.print(pin);
    Serial.print('=');
    Serial.println(digitalRead(pin));
  }
  pinMode(18, OUTPUT);
  pinMode(10, OUTPUT);
  analogWrite(2, 100);
}

void loop() { delay(10); }
