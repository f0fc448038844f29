// The paper's submission load (section V.B): print jobs of random size sent to the print service at
// random intervals.
//
//   submission.py ──HTTP on loopback──► printd (unprivileged) ──► disk
//
// The paper sends thirty files of 50 KB to 150 MB, 0.1 to 10 s apart. Here they come 0.1 to 1 s
// apart for as long as the load lives. A real-time run is kept under 30 s, and should see as many
// files as the paper's runs did in minutes.
#pragma once

#include <sys/types.h>

#include <string>

namespace qduino::bench {

class SubmissionLoad {
  public:
    SubmissionLoad() = default;  ///< no load
    ~SubmissionLoad() { stop(); }
    SubmissionLoad(const SubmissionLoad&) = delete;
    SubmissionLoad& operator=(const SubmissionLoad&) = delete;

    /// Starts printd, in a folder of its own, and the sender. Returns when the first upload is on
    /// its way. Empty, or what went wrong.
    std::string start();
    /// Ends both and removes the folder. The number of uploads answered, and their bytes, can be
    /// asked for afterwards.
    void stop();

    [[nodiscard]] int uploads() const { return uploads_; }
    [[nodiscard]] double megabytes() const { return megabytes_; }

  private:
    void read_log();

    std::string folder_;
    pid_t service_ = 0;
    pid_t sender_ = 0;
    int uploads_ = 0;
    double megabytes_ = 0;
};

}  // namespace qduino::bench
