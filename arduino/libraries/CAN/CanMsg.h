// CanMsg: one frame of a CAN bus: its identifier, and up to eight bytes. (As in ArduinoCore-API.)
//
//   id   bit 31: extended   bits 28…0: the identifier (10…0 of a standard one)
#pragma once

#include <array>
#include <cstdint>

#include "arduino/Print.h"
#include "arduino/Printable.h"

class CanMsg : public Printable {
  public:
    static constexpr std::size_t MAX_DATA_LENGTH = 8;
    static constexpr std::uint32_t CAN_EFF_FLAG = 0x80000000U;
    static constexpr std::uint32_t CAN_SFF_MASK = 0x000007FFU;
    static constexpr std::uint32_t CAN_EFF_MASK = 0x1FFFFFFFU;

    CanMsg() = default;
    /// `bytes` may be null; what is beyond eight bytes is left out.
    CanMsg(std::uint32_t frame_id, std::uint8_t size, const std::uint8_t* bytes);

    [[nodiscard]] bool isStandardId() const { return (id & CAN_EFF_FLAG) == 0; }
    [[nodiscard]] bool isExtendedId() const { return !isStandardId(); }
    [[nodiscard]] std::uint32_t getStandardId() const { return id & CAN_SFF_MASK; }
    [[nodiscard]] std::uint32_t getExtendedId() const { return id & CAN_EFF_MASK; }
    /// "[020] (2) : BEEF"; an extended identifier has eight digits.
    std::size_t printTo(Print& out) const override;

    std::uint32_t id = 0;
    std::uint8_t data_length = 0;
    std::uint8_t data[MAX_DATA_LENGTH] = {};
};

/// The `id` of a frame with this identifier; what is beyond its bits is cut off.
constexpr std::uint32_t CanStandardId(std::uint32_t identifier) { return identifier & CanMsg::CAN_SFF_MASK; }
constexpr std::uint32_t CanExtendedId(std::uint32_t identifier) {
    return CanMsg::CAN_EFF_FLAG | (identifier & CanMsg::CAN_EFF_MASK);
}

namespace arduino {
using ::CanExtendedId;
using ::CanMsg;
using ::CanStandardId;
}  // namespace arduino
