// Asks with #ifdef and #if for what it may use, and has an old way for boards that say no.
#pragma once
#include <Arduino.h>
#include <SPI.h>
#include <Wire.h>

#ifndef digitalPinToInterrupt
#define digitalPinToInterrupt(pin) ((pin) == 2 ? 0 : (pin) == 3 ? 1 : -1)
#endif
#ifdef BUFFER_LENGTH
#if BUFFER_LENGTH > 32
#define CHUNK BUFFER_LENGTH
#else
#define CHUNK 32
#endif
#else
#define CHUNK 16
#endif
#if !defined(HIGH) || !defined(A0) || !defined(PI) || !defined(DEFAULT) || !defined(SPI_MODE0)
#error "this board lacks words of the language"
#endif

class AsksFeatures {
  public:
    const char* transfer(uint8_t value);
    int chunk() const { return CHUNK; }
    int interruptOf(int pin) const { return digitalPinToInterrupt(pin); }
};
