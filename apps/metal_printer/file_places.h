// The memory of this printer's files: some places of one size, taken from the heap once.
//
//   ▓▓▓▓▓░░░  prints        The heap joins no blocks (board/metal/library/heap.h). Files of ever
//   ▓▓░░░░░░  waits         other sizes, each with memory of its own, would use it up; and where no
//   ▓▓▓▓▓▓▓▓  comes in      memory is left the machine ends, in the middle of a print. So a file
//   ▓░░░░░░░  ended         that finds no place is refused.
//
// One thread.
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>

namespace qduino::apps::metal {

/// A place is its holder's until nobody holds it any more. Nothing larger than
/// FilePlaces::kFileBytesMax goes in.
using FileBytes = std::shared_ptr<std::string>;

class FilePlaces {
  public:
    /// A block of the heap has 16 MiB, with its head.
    static constexpr std::size_t kFileBytesMax = (std::size_t{16} << 20) - 64;
    /// 64 MiB of the 128 that an emulated machine has.
    static constexpr std::size_t kPlaces = 4;

    FilePlaces() {
        for (FileBytes& place : places_) {
            place = std::make_shared<std::string>();
            place->reserve(kFileBytesMax);
        }
    }

    /// An empty one; null: all are in use.
    [[nodiscard]] FileBytes take() const {
        for (const FileBytes& place : places_) {
            if (place.use_count() > 1) continue;
            place->clear();
            return place;
        }
        return nullptr;
    }

  private:
    std::array<FileBytes, kPlaces> places_;
};

}  // namespace qduino::apps::metal
