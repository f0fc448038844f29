#include "arduino/libraries/CAN/CanMsg.h"

#include <algorithm>

CanMsg::CanMsg(std::uint32_t frame_id, std::uint8_t size, const std::uint8_t* bytes) : id(frame_id) {
    data_length = static_cast<std::uint8_t>(std::min<std::size_t>(size, MAX_DATA_LENGTH));
    if (bytes) std::copy_n(bytes, data_length, data);
}

std::size_t CanMsg::printTo(Print& out) const {
    constexpr char kDigits[] = "0123456789ABCDEF";
    char text[2 * MAX_DATA_LENGTH];
    std::size_t size = 0;
    for (int shift = isStandardId() ? 8 : 28; shift >= 0; shift -= 4)
        text[size++] = kDigits[getExtendedId() >> shift & 15];
    std::size_t written = out.print('[') + out.write(text, size) + out.print("] (");
    written += out.print(data_length) + out.print(") : ");
    size = 0;
    for (std::size_t i = 0; i < data_length; ++i) {
        text[size++] = kDigits[data[i] >> 4];
        text[size++] = kDigits[data[i] & 15];
    }
    return written + out.write(text, size);
}
