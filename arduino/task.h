// FreeRTOS' tasks, by the name of their header.
#pragma once

#include "arduino/Arduino_FreeRTOS.h"
