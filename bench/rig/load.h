// The paper's submission load (RTAS 2017, section III.C): print jobs of random size, sent to the
// print service at random intervals.
//
//   submission.py ──HTTP on loopback──► printd (unprivileged) ──► disk
//
// As in the paper: the sizes are log-uniform from 50 KB to 150 MB, the pauses uniform from 0.1 to
// 10 s, for as long as the load lives. A network lies between sender and printer there; here both
// are on one computer, which is more work for it.
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
