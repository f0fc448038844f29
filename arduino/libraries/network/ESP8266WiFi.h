// The WiFi of an ESP8266, by its name: here the host's network (WiFi.h).
#pragma once

#include "arduino/libraries/network/WiFi.h"
