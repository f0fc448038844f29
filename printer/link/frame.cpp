#include "printer/link/frame.h"

#include <algorithm>
#include <concepts>

#include "printer/link/crc32.h"

namespace qduino::printer::link {

namespace {

constexpr std::size_t kLengthAt = 4;
constexpr std::size_t kCrcAt = 8;
constexpr std::size_t kCheckedHeaderBytes = kCrcAt;

template <typename Integer>
void store(std::uint8_t* at, Integer value) {
    for (std::size_t i = 0; i < sizeof(Integer); ++i) at[i] = static_cast<std::uint8_t>(value >> (8 * i));
}

template <typename Integer>
Integer load(const std::uint8_t* at) {
    Integer value = 0;
    for (std::size_t i = 0; i < sizeof(Integer); ++i) {
        value = static_cast<Integer>(value | static_cast<Integer>(static_cast<Integer>(at[i]) << (8 * i)));
    }
    return value;
}

template <typename Enum>
bool is_within(std::uint8_t number, Enum first, Enum last) {
    return number >= static_cast<std::uint8_t>(first) && number <= static_cast<std::uint8_t>(last);
}

std::uint32_t checksum(std::span<const std::uint8_t> frame) {
    return crc32(frame.subspan(kFrameHeaderBytes), crc32(frame.first(kCheckedHeaderBytes)));
}

Error wrong_form(std::string_view what) {
    return make_error(ErrorCode::corrupt, "link: payload is no ", what);
}

std::string_view as_text(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::span<const std::uint8_t> as_bytes(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), std::min(text.size(), kMaxText)};
}

}  // namespace

/// Makes a frame whose payload is `fields`, one behind the other.
class FrameBuilder {
  public:
    template <typename Type, typename... Fields>
    static Frame build(Type type, const Fields&... fields) {
        Frame frame;
        store(frame.bytes_.data(), kFrameMagic);
        frame.bytes_[2] = static_cast<std::uint8_t>(type);
        frame.bytes_[3] = 0;
        frame.size_ = kFrameHeaderBytes;
        (add(frame, fields), ...);
        store(frame.bytes_.data() + kLengthAt, static_cast<std::uint32_t>(frame.size_ - kFrameHeaderBytes));
        store(frame.bytes_.data() + kCrcAt, checksum(frame.bytes()));
        return frame;
    }

  private:
    template <std::integral Integer>
    static void add(Frame& frame, Integer value) {
        QDUINO_EXPECT(frame.size_ + sizeof(Integer) <= kFrameMaxBytes);
        store(frame.bytes_.data() + frame.size_, value);
        frame.size_ += sizeof(Integer);
    }
    static void add(Frame& frame, std::span<const std::uint8_t> bytes) {
        QDUINO_EXPECT(frame.size_ + bytes.size() <= kFrameMaxBytes);
        std::ranges::copy(bytes, frame.bytes_.begin() + static_cast<std::ptrdiff_t>(frame.size_));
        frame.size_ += bytes.size();
    }
};

Frame encode(const JobBegin& begin) {
    QDUINO_EXPECT(begin.job_id != 0);
    return FrameBuilder::build(FrameType::job_begin, begin.job_id, begin.length, begin.estimated_s);
}

Frame encode(const JobBytes& bytes) {
    QDUINO_EXPECT(bytes.bytes.size() <= kMaxJobBytes);
    return FrameBuilder::build(FrameType::job_bytes, bytes.job_id, bytes.offset, bytes.bytes);
}

Frame encode(const JobEnd& end) { return FrameBuilder::build(FrameType::job_end, end.job_id); }

Frame encode(const CommandText& command) {
    const auto number = static_cast<std::uint8_t>(command.command);
    return FrameBuilder::build(FrameType::command, number, as_bytes(command.text));
}

Frame encode(const ReplyText& reply) {
    const auto number = static_cast<std::uint8_t>(reply.kind);
    return FrameBuilder::build(FrameType::reply, number, as_bytes(reply.text));
}

Frame encode_raw(std::uint8_t type, std::span<const std::uint8_t> payload) {
    return FrameBuilder::build(type, payload);
}

Result<JobBegin> decode_job_begin(std::span<const std::uint8_t> payload) {
    if (payload.size() != 24) return wrong_form("job_begin");
    const JobBegin begin{load<std::uint64_t>(payload.data()), load<std::uint64_t>(payload.data() + 8),
                         load<std::uint64_t>(payload.data() + 16)};
    if (begin.job_id == 0) return wrong_form("job_begin: job id 0");
    return begin;
}

Result<JobBytes> decode_job_bytes(std::span<const std::uint8_t> payload) {
    if (payload.size() < 16) return wrong_form("job_bytes");
    const JobBytes bytes{load<std::uint64_t>(payload.data()), load<std::uint64_t>(payload.data() + 8),
                         payload.subspan(16)};
    // Without this check, an offset so large that its end wraps would pass every later comparison.
    if (bytes.offset > ~std::uint64_t{0} - bytes.bytes.size())
        return wrong_form("job_bytes: offset too large");
    return bytes;
}

Result<JobEnd> decode_job_end(std::span<const std::uint8_t> payload) {
    if (payload.size() != 8) return wrong_form("job_end");
    return JobEnd{load<std::uint64_t>(payload.data())};
}

Result<CommandText> decode_command(std::span<const std::uint8_t> payload) {
    if (payload.empty()) return wrong_form("command");
    if (!is_within(payload[0], Command::pause, Command::host_line))
        return wrong_form("command that is known");
    return CommandText{static_cast<Command>(payload[0]), as_text(payload.subspan(1))};
}

Result<ReplyText> decode_reply(std::span<const std::uint8_t> payload) {
    if (payload.empty()) return wrong_form("reply");
    if (!is_within(payload[0], ReplyKind::text, ReplyKind::host_error))
        return wrong_form("reply of a known kind");
    return ReplyText{static_cast<ReplyKind>(payload[0]), as_text(payload.subspan(1))};
}

Result<std::size_t> FrameReader::check_header(std::size_t available) const {
    if (load<std::uint16_t>(buffer_.data()) != kFrameMagic)
        return make_error(ErrorCode::corrupt, "link: no frame starts here");
    if (!is_within(buffer_[2], FrameType::job_begin, FrameType::reply) || buffer_[3] != 0)
        return make_error(ErrorCode::corrupt, "link: unknown frame type");
    const std::uint32_t length = load<std::uint32_t>(buffer_.data() + kLengthAt);
    if (length > kMaxPayload) return make_error(ErrorCode::corrupt, "link: frame too long");
    if (length > available) return make_error(ErrorCode::corrupt, "link: frame cut short");
    return std::size_t{length};
}

bool FrameReader::checksum_fits(std::size_t length) const {
    const std::span<const std::uint8_t> frame = std::span{buffer_}.first(kFrameHeaderBytes + length);
    return load<std::uint32_t>(buffer_.data() + kCrcAt) == checksum(frame);
}

FrameView FrameReader::view(std::size_t length) const {
    return {static_cast<FrameType>(buffer_[2]), std::span{buffer_}.subspan(kFrameHeaderBytes, length)};
}

}  // namespace qduino::printer::link
