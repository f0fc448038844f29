// Server: waits for connections; print() on it reaches all of them. NetServer (Network.h) is one
// over TCP.
#pragma once

#include "arduino/Print.h"

class Server : public Print {
  public:
    virtual void begin() = 0;
};

namespace arduino {
using ::Server;
}  // namespace arduino
