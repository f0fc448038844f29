// A serial host and a wire that damages what it says and hears.
#pragma once

#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

namespace qduino::tests {

inline std::string numbered(std::int64_t number, const std::string& code) {
    const std::string line = "N" + std::to_string(number) + " " + code;
    unsigned sum = 0;
    for (const char c : line) sum ^= static_cast<unsigned char>(c);
    return line + "*" + std::to_string(sum) + "\n";
}

/// A wire that damages one byte of some messages: a bit flips, or the byte is lost.
class NoisyWire {
  public:
    NoisyWire(std::uint64_t seed, double share) : random_(seed), share_(share) {}

    std::string carry(std::string message) {
        if (message.empty() || std::uniform_real_distribution{}(random_) >= share_) return message;
        const std::size_t at = random_() % message.size();
        if (random_() % 2 == 0) {
            message.erase(at, 1);
        } else {
            message[at] = static_cast<char>(message[at] ^ 1 << random_() % 7);
        }
        return message;
    }

    /// Each line is a message of its own.
    std::string carry_lines(const std::string& lines) {
        std::string arrived;
        for (std::size_t at = 0; at < lines.size();) {
            const std::size_t end = lines.find('\n', at) + 1;
            arrived += carry(lines.substr(at, end - at));
            at = end;
        }
        return arrived;
    }

  private:
    std::mt19937_64 random_;
    double share_;
};

/// A host as Printrun is one: sends the next line at each ok, goes back when asked, and goes on
/// when it has heard nothing `patience` times.
class PingPongHost {
  public:
    explicit PingPongHost(std::vector<std::string> lines, int patience = 20)
        : lines_(std::move(lines)), patience_(patience) {}

    void hear(const std::string& bytes) {
        heard_ += bytes;
        for (std::size_t end = heard_.find('\n'); end != std::string::npos; end = heard_.find('\n')) {
            const std::string line = heard_.substr(0, end);
            heard_.erase(0, end + 1);
            silent_ = 0;
            if (line.starts_with("ok")) clear_ = true;
            if (line.starts_with("Resend: ")) next_ = std::strtoull(line.c_str() + 8, nullptr, 10);
        }
    }
    /// The next line, or nothing yet. A damaged Resend, and the end, lead to the last line.
    std::string speak() {
        if (next_ > lines_.size() || next_ == 0) next_ = lines_.size();
        if (!clear_ && ++silent_ < patience_) return {};
        clear_ = false;
        silent_ = 0;
        const std::string line = numbered(static_cast<std::int64_t>(next_), lines_[next_ - 1]);
        ++next_;
        return line;
    }

  private:
    std::vector<std::string> lines_;
    std::size_t next_ = 1;  // line numbers begin with 1
    std::string heard_;
    bool clear_ = true;
    int patience_;
    int silent_ = 0;
};

}  // namespace qduino::tests
