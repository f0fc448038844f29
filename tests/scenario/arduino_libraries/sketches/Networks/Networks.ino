#include <ESP8266WiFi.h>
#include <Ethernet.h>
#include <WiFi.h>

byte mac[6];
const byte gateway[4] = {192, 168, 0, 1};

void printEncryption(int kind) {
  switch (kind) {
    case ENC_TYPE_WEP: Serial.println("WEP"); break;
    case ENC_TYPE_TKIP: Serial.println("WPA"); break;
    case ENC_TYPE_CCMP: Serial.println("WPA2"); break;
    case ENC_TYPE_NONE: Serial.println("none"); break;
    case ENC_TYPE_AUTO: Serial.println("auto"); break;
  }
}

void setup() {
  Serial.begin(9600);
  if (WiFi.status() == WL_NO_SHIELD) Serial.println("no shield");
  WiFi.begin("network", "password");
  Serial.println(WiFi.SSID());
  Serial.println(WiFi.scanNetworks());
  printEncryption(WiFi.encryptionType());
  WiFi.macAddress(mac);
  IPAddress ip;
  ip = gateway;
  Serial.println(ip);
  IPAddress found;
  Serial.println(WiFi.hostByName("127.0.0.1", found));
  Serial.println(found);
  Ethernet.MACAddress(mac);
  Serial.println(Ethernet.gatewayIP() == WiFi.gatewayIP() && Ethernet.subnetMask() == WiFi.subnetMask());
  EthernetServer server(0);
  server.begin();
  EthernetClient client = server.accept();
  Serial.println(client ? "somebody" : "nobody");
  Serial.println(WiFi.mode(WIFI_STA) && WiFi.waitForConnectResult() == WiFi.status());
  Serial.println(WiFi.mode(WIFI_AP) ? "an access point" : "a station");
  Serial.println(WiFi.macAddress().length());
  // No resolver is asked for a name that can be none. In the simulator it takes 0.1 s all the same.
  const unsigned long before = millis();
  Serial.println(WiFi.hostByName("no..body", found));
  Serial.println((millis() - before + 5) / 10);
}

void loop() { delay(1000); }
