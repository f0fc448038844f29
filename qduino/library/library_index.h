// The index of Arduino's Library Manager: library_index.json, in which every version of every
// library has an entry with its archive, size and SHA-256.
//
// Source: "Library Manager", Arduino's package index (arduino.github.io/arduino-cli); the keys are
// those of downloads.arduino.cc/libraries/library_index.json.
#pragma once

#include <compare>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace qduino::apps {

struct IndexedLibrary {
    std::string name, version, sentence;
    std::string url;         ///< of its zip
    std::uint64_t size = 0;  ///< of the zip, in bytes
    std::string sha256;      ///< of the zip: 64 lower-case digits; empty: the index has none
    std::vector<std::string> depends;
};

/// "1.10.0" is after "1.9", and "1.0.0" after "1.0.0-rc.1": numbers as numbers, words by the
/// alphabet; what is missing is 0.
[[nodiscard]] std::strong_ordering compare_versions(std::string_view a, std::string_view b);

class LibraryIndex {
  public:
    /// Reads library_index.json. Entries without a name, a version or a URL are left out. Error:
    /// corrupt.
    [[nodiscard]] static Result<LibraryIndex> read(std::string_view json);

    /// The newest version of `name`, or the one that is asked for; null: there is none.
    [[nodiscard]] const IndexedLibrary* find(std::string_view name, std::string_view version = "") const;
    /// The newest version of each library that has all `words` in its name or sentence, by name.
    /// Letters may be capital or small.
    [[nodiscard]] std::vector<const IndexedLibrary*> search(const std::vector<std::string>& words) const;
    /// The name that is most like `name`; empty: none is.
    [[nodiscard]] std::string nearest_name(const std::string& name) const;

  private:
    std::vector<IndexedLibrary> libraries_;  // by name, the newest version first
};

}  // namespace qduino::apps
