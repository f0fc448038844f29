// The objects of a plate, and which of them are left out: M486 and EXCLUDE_OBJECT.
//
//   M486 S2   or   EXCLUDE_OBJECT_START NAME=lid      what follows belongs to it
//   M486 P2   or   EXCLUDE_OBJECT NAME=lid            it is left out from here on
//   M486 S-1  or   EXCLUDE_OBJECT_END                 what follows belongs to none
//
// Only keys of names are kept (name_key.h), in capitals as Klipper takes them: what an object looks
// like does not matter. The head waits where it is while lines of an object go by that is left out,
// and then until a line goes sideways: Context::rejoin() brings it to that place. A retraction and
// a way up between the two are done at once. Bounded; no heap.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "base/fixed_vector.h"
#include "printer/gcode/name_key.h"

namespace qduino::printer::gcode {

class Objects {
  public:
    static constexpr std::size_t kExcludedMax = 1024;

    /// Makes it as new: no object is excluded, and none has begun.
    void reset() {
        excluded_.clear();
        changes_ = 0;
        inside_ = skipping_ = false;
    }
    void begin(std::string_view name) {
        current_ = key_in_any_case(name);
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

    /// False: no room for another name.
    [[nodiscard]] bool exclude(std::string_view name) { return exclude(key_in_any_case(name)); }
    /// The object in hand. Contract: inside().
    [[nodiscard]] bool exclude_current() { return exclude(current_); }
    void include(std::string_view name) {
        const NameKey key = key_in_any_case(name);
        for (std::size_t i = excluded_.size(); i-- > 0;) {
            if (excluded_[i] != key) continue;
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
        for (const NameKey& key : other.excluded_) static_cast<void>(exclude(key));
    }

  private:
    [[nodiscard]] bool exclude(const NameKey& key) {
        if (is_excluded(key)) return true;
        if (!excluded_.try_push_back(key)) return false;
        ++changes_;
        note_change();
        return true;
    }
    [[nodiscard]] bool is_excluded(const NameKey& key) const {
        return std::ranges::find(excluded_, key) != excluded_.end();
    }
    void note_change() { skipping_ = inside_ && is_excluded(current_); }

    FixedVector<NameKey, kExcludedMax> excluded_;
    NameKey current_;
    std::uint32_t changes_ = 0;
    bool inside_ = false;
    bool skipping_ = false;
};

}  // namespace qduino::printer::gcode
