// A light that a browser switches, and a pulse train that no request disturbs.
//
//   /on, /off        switch the light on pin 13
//   anything else    says whether it is on
//
//   core 0   loop 1, and the network's bottom half     core 1   loop 2: pulses on pin 6
//
// Without Linux:  qduino metal run sketches/web_light --forward 8080:8080
// and then        curl http://127.0.0.1:8080/on

#include <WiFi.h>

WiFiServer server(8080);

void setup() {
  for (int pin : {LED_BUILTIN, 6}) {
    pinMode(pin, OUTPUT);
    safeState(pin, LOW);
  }
  Serial.begin(115200);
  noInterrupts(NIC, 1);
  interruptsVcpu(NIC, 5, 50, 0);
  WiFi.begin("any network", "no password");
  while (WiFi.status() != WL_CONNECTED) delay(10);
  server.begin();
  Serial.print("ready at ");
  Serial.println(WiFi.localIP());
}

void answer(WiFiClient& client) {
  client.print("HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\nThe light is ");
  client.println(digitalRead(LED_BUILTIN) == HIGH ? "on." : "off.");
  client.stop();
}

void loop(1, 10, 100, 0) {
  WiFiClient client = server.available();
  if (client) {
    const String request = client.readStringUntil('\n');
    if (request.startsWith("GET /on ")) digitalWrite(LED_BUILTIN, HIGH);
    if (request.startsWith("GET /off ")) digitalWrite(LED_BUILTIN, LOW);
    answer(client);
  }
  waitForNextPeriod();
}

void loop(2, 100, 100, 1) {
  digitalWrite(6, HIGH);
  delayMicroseconds(100);
  digitalWrite(6, LOW);
  delayMicroseconds(900);
}
