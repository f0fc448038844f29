// A text as the source of an asked path.
#pragma once

#include <algorithm>
#include <string>
#include <utility>

#include "twin/byte_source.h"

namespace qduino::twin {

class TextSource final : public ByteSource {
  public:
    explicit TextSource(std::string text) : text_(std::move(text)) {}
    std::size_t read(std::span<char> into) override {
        const std::size_t count = std::min(into.size(), text_.size() - at_);
        std::copy_n(text_.data() + at_, count, into.data());
        at_ += count;
        return count;
    }

  private:
    std::string text_;
    std::size_t at_ = 0;
};

}  // namespace qduino::twin
