#include <FastAccelStepper.h>

FastAccelStepperEngine engine = FastAccelStepperEngine();
FastAccelStepper *stepper = NULL;

void setup() {
  Serial.begin(115200);
  engine.init();
  stepper = engine.stepperConnectToPin(9);
  if (stepper) {
    stepper->setDirectionPin(5);
    stepper->setEnablePin(6);
    stepper->setAutoEnable(true);
    stepper->setSpeedInUs(1000);
    stepper->setAcceleration(1000);
    stepper->move(1000);
  }
}

void loop() {
  delay(1900);
  Serial.println(stepper->isRunning());
  delay(200);
  Serial.println(stepper->isRunning());
  Serial.println(stepper->getCurrentPosition());
  stepper->moveTo(-50, true);
  Serial.println(stepper->getCurrentPosition());
  delay(100000);
}
