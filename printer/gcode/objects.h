// The objects of a plate, and which of them are left out: M486 and EXCLUDE_OBJECT.
//
//   M486 S2   or   EXCLUDE_OBJECT_START NAME=lid      what follows belongs to it
//   M486 P2   or   EXCLUDE_OBJECT NAME=lid            it is left out from here on
//   M486 S-1  or   EXCLUDE_OBJECT_END                 what follows belongs to none
//
// Only names are kept, in capitals as Klipper takes them: what an object looks like does not
// matter. The head waits where it is while lines of an object go by that is left out, and then
// until a line goes sideways: Context::rejoin() brings it to that place. Bounded; no heap.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "base/fixed_string.h"
#include "base/fixed_vector.h"
#include "printer/gcode/text.h"

namespace qduino::printer::gcode {

class Objects {
  public:
    static constexpr std::size_t kExcludedMax = 64;
    /// A longer name is cut; names that agree so far are one.
    using Name = FixedString<64>;

    void begin(std::string_view name) {
        current_ = key_of(name);
        inside_ = true;
        note_change();
    }
    void end() {
        inside_ = false;
        note_change();
    }
    /// True while lines go by that are not to be printed.
    [[nodiscard]] bool skipping() const { return skipping_; }
    [[nodiscard]] bool inside() const { return inside_; }
    [[nodiscard]] std::string_view current() const { return current_.view(); }

    /// False: no room for another name.
    [[nodiscard]] bool exclude(std::string_view name) {
        const Name cut = key_of(name);
        if (is_excluded(cut.view())) return true;
        if (!excluded_.try_push_back(cut)) return false;
        ++changes_;
        note_change();
        return true;
    }
    void include(std::string_view name) {
        const Name cut = key_of(name);
        for (std::size_t i = excluded_.size(); i-- > 0;) {
            if (excluded_[i].view() != cut.view()) continue;
            excluded_.erase(i);
            ++changes_;
        }
        note_change();
    }
    void include_all() {
        if (!excluded_.empty()) ++changes_;
        excluded_.clear();
        note_change();
    }
    /// How often it has changed which objects are left out.
    [[nodiscard]] std::uint32_t changes() const { return changes_; }
    /// Leaves out as well what `other` leaves out, as far as there is room.
    void adopt(const Objects& other) {
        for (const Name& name : other.excluded_) static_cast<void>(exclude(name.view()));
    }

  private:
    [[nodiscard]] static Name key_of(std::string_view name) {
        Name key;
        for (const char c : name.substr(0, Name::kCapacity)) key.push_back(to_upper(c));
        return key;
    }
    [[nodiscard]] bool is_excluded(std::string_view name) const {
        return std::ranges::any_of(excluded_, [=](const Name& held) { return held.view() == name; });
    }
    void note_change() { skipping_ = inside_ && is_excluded(current_.view()); }

    FixedVector<Name, kExcludedMax> excluded_;
    Name current_;
    std::uint32_t changes_ = 0;
    bool inside_ = false;
    bool skipping_ = false;
};

}  // namespace qduino::printer::gcode
