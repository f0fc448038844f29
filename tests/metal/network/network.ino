// Takes what it is sent, and says what that was, beside a pulse train that must not notice.
//
//   core 0   loop 1, and the network's bottom half
//              /tcp/PORT, /udp/PORT   asks the computer around the machine, and hands on its answer
//              anything else          the number of the body's bytes, and their SHA-256
//            a byte on the serial line ends the run
//   core 1   loop 2: a pulse train; no interrupts there           pin 6

#include <WiFi.h>
#include <WiFiUdp.h>

#include "base/sha256.h"
#include "board/board.h"

const IPAddress around(10, 0, 2, 2);
WiFiServer server(80);

void setup() {
  Serial.begin(115200);
  pinMode(6, OUTPUT);
  safeState(6, LOW);
  noInterrupts(ALL, 1);
  noTimer(1);
  interruptsVcpu(NIC, 10, 50, 0);
  WiFi.begin("any network", "no password");
  while (WiFi.status() != WL_CONNECTED) delay(10);
  server.begin();
  Serial.print("ready at ");
  Serial.println(WiFi.localIP());
}

String ask_by_tcp(uint16_t port) {
  WiFiClient other;
  if (!other.connect(around, port)) return "nobody";
  other.println("who is there?");
  return other.readStringUntil('\n');
}

String ask_by_udp(uint16_t port) {
  WiFiUDP socket;
  socket.begin(0);
  socket.beginPacket(around, port);
  socket.print("who is there?");
  socket.endPacket();
  for (int i = 0; i < 1000 && socket.parsePacket() == 0; ++i) delay(1);
  String answer;
  while (socket.available()) answer += (char)socket.read();
  return answer.length() > 0 ? answer : "nobody";
}

/// "12 ab34…": so many bytes, with this hash.
String taken_in(WiFiClient& client, long length) {
  static uint8_t piece[4096];
  qduino::BareSha256 hash;
  long bytes = 0;
  while (bytes < length && client.connected()) {
    const int count = client.read(piece, sizeof piece);
    if (count > 0) {
      hash.add({reinterpret_cast<const char*>(piece), size_t(count)});
      bytes += count;
    }
    if (count == 0) delay(1);
  }
  return String(bytes) + " " + hash.finish().c_str();
}

void answer(WiFiClient& client) {
  const String request = client.readStringUntil('\n');
  long length = 0;
  for (String line = client.readStringUntil('\n'); line.length() > 1; line = client.readStringUntil('\n')) {
    if (line.startsWith("Content-Length: ")) length = line.substring(16).toInt();
  }
  String words;
  if (request.startsWith("GET /tcp/")) words = ask_by_tcp(request.substring(9).toInt());
  else if (request.startsWith("GET /udp/")) words = ask_by_udp(request.substring(9).toInt());
  else words = taken_in(client, length);
  client.print("HTTP/1.1 200 OK\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\n");
  client.print(words);
  client.stop();
}

void loop(1, 40, 100, 0) {
  WiFiClient client = server.available();
  if (client) answer(client);
  else if (Serial.available()) qduino::board::current().request_stop();
  else waitForNextPeriod();
}

void loop(2, 100, 100, 1) {
  digitalWrite(6, HIGH);
  delayMicroseconds(100);
  digitalWrite(6, LOW);
}
