// Which objects of a plate the file leaves out (M486, EXCLUDE_OBJECT).
//
// The head stays where it is while lines go by of an object that is left out.
#pragma once

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "twin/line_reader.h"

namespace qduino::twin {

class AskedObjects {
  public:
    /// True while lines go by that are not to be built.
    [[nodiscard]] bool skipping() const { return inside_ && left_out_.contains(current_); }

    /// Whatever `command` says of objects.
    void run(const CommandLine& command) {
        if (command.letter == 'M' && command.number == 486) return labels(command);
        if (command.word == "EXCLUDE_OBJECT_START" || command.word == "START_CURRENT_OBJECT")
            begin(name_of(command));
        if (command.word == "EXCLUDE_OBJECT_END" || command.word == "END_CURRENT_OBJECT") inside_ = false;
        if (command.word == "EXCLUDE_OBJECT") exclude(command);
    }

  private:
    static std::string name_of(const CommandLine& command) {
        if (const auto name = command.word_name("NAME", {"CENTER", "POLYGON", "CURRENT", "RESET", "JSON"}))
            return in_capitals(std::string{*name});
        if (command.tail.find('=') != std::string::npos) return {};
        std::string bare = command.tail;
        bare.erase(0, std::min(bare.find_first_not_of(" \t"), bare.size()));
        return in_capitals(std::move(bare));
    }
    /// Names are the same in any case.
    static std::string in_capitals(std::string name) {
        for (char& c : name)
            if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
        return name;
    }
    static std::string numbered(double index) {
        return std::to_string(std::llround(std::trunc(std::clamp(index, -1e9, 1e9))));
    }

    void begin(std::string name) {
        inside_ = true;
        current_ = std::move(name);
    }
    void exclude(const CommandLine& command) {
        const std::string name = name_of(command);
        if (command.word_value("RESET")) {
            if (name.empty()) left_out_.clear();
            left_out_.erase(name);
        } else if (!name.empty()) {
            left_out_.insert(name);
        } else if (inside_ && command.word_value("CURRENT")) {
            left_out_.insert(current_);
        }
    }
    void labels(const CommandLine& command) {
        const double begins = command.value('S');
        if (command.has_number('S') && begins >= 0) begin(numbered(begins));
        if (command.has_number('S') && begins < 0) inside_ = false;
        if (command.has('C') && inside_) left_out_.insert(current_);
        if (command.has_number('P')) left_out_.insert(numbered(command.value('P')));
        if (command.has_number('U')) left_out_.erase(numbered(command.value('U')));
    }

    std::set<std::string> left_out_;
    std::string current_;
    bool inside_ = false;
};

}  // namespace qduino::twin
