// Processes that stand around what is measured: programs that run beside it, work that takes their
// CPU time, and this process above them all.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace qduino::bench {

/// Starts a program that says nothing; it gets SIGTERM when this process ends. `words[0]` is its
/// path. With `output`, what it prints goes there, errors as well.
pid_t start_quietly(const std::vector<std::string>& words, const std::string& output = "/dev/null");

/// Processes that only compute, for as long as this lives.
class Busy {
  public:
    explicit Busy(int count);
    ~Busy();
    Busy(const Busy&) = delete;
    Busy& operator=(const Busy&) = delete;

  private:
    std::vector<pid_t> children_;
};

/// This process above everything that it watches; its children are ordinary.
class AboveAll {
  public:
    AboveAll();
    ~AboveAll();
    AboveAll(const AboveAll&) = delete;
    AboveAll& operator=(const AboveAll&) = delete;
};

}  // namespace qduino::bench
