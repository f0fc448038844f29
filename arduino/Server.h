// Server: what waits for connections; printing to it reaches all that it has. NetServer (Network.h) is one over TCP.
#pragma once

#include "arduino/Print.h"

class Server : public Print {
  public:
    virtual void begin() = 0;
};
