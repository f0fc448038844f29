#include "printer/link/frame.h"

#include <algorithm>

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

bool is_known(std::uint8_t type) {
    return type >= static_cast<std::uint8_t>(FrameType::job_begin) &&
           type <= static_cast<std::uint8_t>(FrameType::reply);
}

std::uint32_t checksum(std::span<const std::uint8_t> frame) {
    return crc32(frame.subspan(kFrameHeaderBytes), crc32(frame.first(kCheckedHeaderBytes)));
}

Error wrong_form(std::string_view what) {
    return Error{ErrorCode::corrupt, FixedString<236>{"link: payload is no "}.append(what)};
}

std::string_view as_text(std::span<const std::uint8_t> bytes) {
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::span<const std::uint8_t> as_bytes(std::string_view text) {
    return {reinterpret_cast<const std::uint8_t*>(text.data()), std::min(text.size(), kMaxText)};
}

}  // namespace

/// Appends payload fields behind a header that finish() fills in.
class FrameBuilder {
  public:
    explicit FrameBuilder(std::uint8_t type) {
        store(frame_.bytes_.data(), kFrameMagic);
        frame_.bytes_[2] = type;
        frame_.bytes_[3] = 0;
        frame_.size_ = kFrameHeaderBytes;
    }
    explicit FrameBuilder(FrameType type) : FrameBuilder(static_cast<std::uint8_t>(type)) {}

    template <typename Integer>
    FrameBuilder& add(Integer value) {
        QDUINO_EXPECT(frame_.size_ + sizeof(Integer) <= kFrameMaxBytes);
        store(frame_.bytes_.data() + frame_.size_, value);
        frame_.size_ += sizeof(Integer);
        return *this;
    }
    FrameBuilder& add(std::span<const std::uint8_t> bytes) {
        QDUINO_EXPECT(frame_.size_ + bytes.size() <= kFrameMaxBytes);
        std::copy(bytes.begin(), bytes.end(),
                  frame_.bytes_.begin() + static_cast<std::ptrdiff_t>(frame_.size_));
        frame_.size_ += bytes.size();
        return *this;
    }
    Frame finish() {
        store(frame_.bytes_.data() + kLengthAt, static_cast<std::uint32_t>(frame_.size_ - kFrameHeaderBytes));
        store(frame_.bytes_.data() + kCrcAt, checksum(frame_.bytes()));
        return frame_;
    }

  private:
    Frame frame_;
};

Frame encode(const JobBegin& begin) {
    QDUINO_EXPECT(begin.job_id != 0);
    return FrameBuilder{FrameType::job_begin}.add(begin.job_id).add(begin.length).finish();
}

Frame encode(const JobBytes& bytes) {
    QDUINO_EXPECT(bytes.bytes.size() <= kMaxJobBytes);
    return FrameBuilder{FrameType::job_bytes}.add(bytes.job_id).add(bytes.offset).add(bytes.bytes).finish();
}

Frame encode(const JobEnd& end) { return FrameBuilder{FrameType::job_end}.add(end.job_id).finish(); }

Frame encode(const CommandText& command) {
    return FrameBuilder{FrameType::command}
        .add(static_cast<std::uint8_t>(command.command))
        .add(as_bytes(command.text))
        .finish();
}

Frame encode(const ReplyText& reply) {
    return FrameBuilder{FrameType::reply}
        .add(static_cast<std::uint8_t>(reply.kind))
        .add(as_bytes(reply.text))
        .finish();
}

Frame encode_raw(std::uint8_t type, std::span<const std::uint8_t> payload) {
    return FrameBuilder{type}.add(payload).finish();
}

Result<JobBegin> decode_job_begin(std::span<const std::uint8_t> payload) {
    if (payload.size() != 16) return wrong_form("job_begin");
    const JobBegin begin{load<std::uint64_t>(payload.data()), load<std::uint64_t>(payload.data() + 8)};
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
    if (payload[0] < static_cast<std::uint8_t>(Command::pause) ||
        payload[0] > static_cast<std::uint8_t>(Command::clear_fault)) {
        return wrong_form("command that is known");
    }
    return CommandText{static_cast<Command>(payload[0]), as_text(payload.subspan(1))};
}

Result<ReplyText> decode_reply(std::span<const std::uint8_t> payload) {
    if (payload.empty()) return wrong_form("reply");
    if (payload[0] < static_cast<std::uint8_t>(ReplyKind::text) ||
        payload[0] > static_cast<std::uint8_t>(ReplyKind::error)) {
        return wrong_form("reply of a known kind");
    }
    return ReplyText{static_cast<ReplyKind>(payload[0]), as_text(payload.subspan(1))};
}

Result<std::size_t> FrameReader::check_header(std::size_t available) const {
    if (load<std::uint16_t>(buffer_.data()) != kFrameMagic) {
        return make_error(ErrorCode::corrupt, "link: no frame starts here");
    }
    if (!is_known(buffer_[2]) || buffer_[3] != 0) {
        return make_error(ErrorCode::corrupt, "link: unknown frame type");
    }
    const std::uint32_t length = load<std::uint32_t>(buffer_.data() + kLengthAt);
    if (length > kMaxPayload) return make_error(ErrorCode::corrupt, "link: frame too long");
    if (length > available) return make_error(ErrorCode::corrupt, "link: frame cut short");
    return static_cast<std::size_t>(length);
}

bool FrameReader::checksum_fits(std::size_t length) const {
    const std::span<const std::uint8_t> frame = std::span{buffer_}.first(kFrameHeaderBytes + length);
    return load<std::uint32_t>(buffer_.data() + kCrcAt) == checksum(frame);
}

FrameView FrameReader::view(std::size_t length) const {
    return {static_cast<FrameType>(buffer_[2]), std::span{buffer_}.subspan(kFrameHeaderBytes, length)};
}

}  // namespace qduino::printer::link
