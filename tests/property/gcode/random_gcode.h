// Random G-code for the property tests: well-formed, nearly so, and not at all. Every stream comes
// from one seed, which a failing test prints.
#pragma once

#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

namespace qduino::printer::gcode {

class RandomGcode {
  public:
    explicit RandomGcode(std::uint64_t seed) : random_(seed) {}

    std::uint64_t below(std::uint64_t bound) { return random_() % bound; }
    bool chance(double probability) {
        return std::uniform_real_distribution<double>{0, 1}(random_) < probability;
    }
    double uniform(double low, double high) {
        return std::uniform_real_distribution<double>{low, high}(random_);
    }

    template <typename T, std::size_t N>
    const T& pick(const T (&items)[N]) {
        return items[below(N)];
    }

    /// A decimal number as slicers write it, with `decimals` or fewer.
    std::string number(double low, double high, int decimals) {
        char text[64];
        std::snprintf(text, sizeof text, "%.*f",
                      static_cast<int>(below(static_cast<std::uint64_t>(decimals) + 1)), uniform(low, high));
        std::string out{text};
        if (chance(0.2) && out.rfind("0.", 0) == 0) out.erase(0, 1);
        if (chance(0.05) && out[0] != '-') out.insert(0, "+");
        return out;
    }

    /// A well-formed command of letters and numbers in any spelling.
    std::string command() {
        std::string out = spelled(pick(kLetters)) + std::to_string(below(1000));
        if (chance(0.05)) out += "." + std::to_string(below(10));
        std::string letters = "ABCDEFHIJKLOPQRSUVWXYZ";
        for (std::uint64_t count = below(6); count > 0 && !letters.empty(); --count) {
            const std::size_t at = below(letters.size());
            // Behind a digit E may begin an exponent: that has tests of its own.
            out += (letters[at] == 'E' ? " " : gap()) + spelled(letters[at]);
            letters.erase(at, 1);
            if (chance(0.8)) {
                out += gap() + number(-200, 200, 5);
            } else {
                out += " ";
            }
        }
        return out;
    }

    /// Bytes that look much like G-code, and often are none.
    std::string noise(std::size_t size) {
        static const char* const kTokens[] = {
            "G1",  " X10",   " Y-5.5",       " E.1",   " F1800",   "\n",     "\r\n", "\r",     ";",     "(",
            ")",   "\"",     "*57",          "N5 ",    "M117 ",    "M104 S", "G28",  "G92",    "G91",   " Z",
            "--",  "1e9",    "inf",          "nan",    ".",        " ",      "\t",   "G2",     " I5",   " J",
            "T1",  "M486 A", "EXCLUDE_",     ";TYPE:", ";LAYER:1", "G10",    "G11",  "M221 S", "99999", "G20",
            "M83", "0x",     "\xEF\xBB\xBF", "%",      "M0 "};
        std::string out;
        while (out.size() < size) {
            if (chance(0.05)) {
                out += static_cast<char>(below(256));
            } else if (chance(0.2)) {
                out +=
                    "\nG" + std::to_string(below(4)) + " X" + number(-5, 155, 3) + " Y" + number(-5, 155, 3);
                if (chance(0.3)) out += " I" + number(-50, 50, 2) + " J" + number(-50, 50, 2);
                if (chance(0.3)) out += " R" + number(-500, 500, 2);
                if (chance(0.5)) out += "\n";
            } else {
                out += pick(kTokens);
            }
        }
        return out;
    }

    /// `text` in random pieces, empty ones too.
    std::vector<std::string> cut(const std::string& text) {
        std::vector<std::string> pieces;
        const std::uint64_t largest = 1 + below(chance(0.5) ? 8 : 400);
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t size = below(largest + 1);
            pieces.push_back(text.substr(at, size));
            at += size;
        }
        return pieces;
    }

  private:
    static constexpr char kLetters[] = {'G', 'M', 'T', 'G', 'M'};
    std::string gap() { return chance(0.3) ? std::string(below(3), ' ') : " "; }
    std::string spelled(char letter) {
        return std::string(1, chance(0.2) ? static_cast<char>(letter - 'A' + 'a') : letter);
    }
    std::mt19937_64 random_;
};

}  // namespace qduino::printer::gcode
