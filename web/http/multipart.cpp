#include "web/http/multipart.h"

#include <algorithm>
#include <optional>

#include "web/http/http.h"

namespace qduino::web {

namespace {

Error malformed(std::string_view what) {
    return make_error(ErrorCode::invalid_argument, "multipart: ", what);
}

Error too_large(std::string_view what) { return make_error(ErrorCode::out_of_range, "multipart: ", what); }

/// RFC 2046 §5.1.1: 1 to 70 of these, the last no space.
bool is_boundary(std::string_view text) {
    const auto allowed = [](char c) {
        return is_letter_or_digit(c) || std::string_view{"'()+_,-./:=? "}.find(c) != std::string_view::npos;
    };
    return !text.empty() && text.size() <= 70 && text.back() != ' ' &&
           std::all_of(text.begin(), text.end(), allowed);
}

struct Parameter {
    std::string_view name;
    std::string value;
};

/// A quoted string. `\"` and `\\` are escapes; any other backslash stays: browsers send Windows
/// paths unescaped.
std::optional<std::string> take_quoted(std::string_view& rest) {
    std::string value;
    for (std::size_t i = 1; i < rest.size(); ++i) {
        if (rest[i] == '"') {
            rest.remove_prefix(i + 1);
            return value;
        }
        const bool escape =
            rest[i] == '\\' && i + 1 < rest.size() && (rest[i + 1] == '"' || rest[i + 1] == '\\');
        if (escape) ++i;
        value += rest[i];
    }
    return std::nullopt;
}

/// The next `; name=value` of a header's value. Nothing at its end; sets `broken` when it has
/// another form.
std::optional<Parameter> take_parameter(std::string_view& rest, bool& broken) {
    rest = trimmed(rest);
    while (rest.starts_with(';')) rest = trimmed(rest.substr(1));
    if (rest.empty()) return std::nullopt;
    broken = rest.find('=') == std::string_view::npos;
    if (broken) return std::nullopt;
    Parameter parameter;
    parameter.name = trimmed(take_until(rest, '='));
    rest = trimmed(rest);
    if (rest.starts_with('"')) {
        std::optional<std::string> value = take_quoted(rest);
        const std::string_view behind = trimmed(rest);
        broken = !value || (!behind.empty() && behind.front() != ';');
        if (broken) return std::nullopt;
        parameter.value = std::move(*value);
        return parameter;
    }
    const std::size_t end = std::min(rest.find(';'), rest.size());
    parameter.value = trimmed(rest.substr(0, end));
    rest.remove_prefix(end);
    return parameter;
}

/// RFC 5987: charset'language'percent-encoded. Only UTF-8 is in use.
std::optional<std::string> extended_value(std::string_view text) {
    const std::size_t first = text.find('\'');
    if (first == std::string_view::npos) return std::nullopt;
    const std::size_t second = text.find('\'', first + 1);
    if (second == std::string_view::npos || !equal_ignoring_case(text.substr(0, first), "UTF-8"))
        return std::nullopt;
    return percent_decoded(text.substr(second + 1));
}

Result<void> read_disposition(std::string_view value, PartHead& head) {
    const std::size_t semicolon = std::min(value.find(';'), value.size());
    if (!equal_ignoring_case(trimmed(value.substr(0, semicolon)), "form-data")) {
        return malformed("a part is no form-data");
    }
    std::string_view rest = value.substr(semicolon);
    bool broken = false;
    bool named = false;
    std::optional<std::string> extended;
    while (std::optional<Parameter> parameter = take_parameter(rest, broken)) {
        if (equal_ignoring_case(parameter->name, "name")) {
            head.name = std::move(parameter->value);
            named = true;
        } else if (equal_ignoring_case(parameter->name, "filename")) {
            head.file_name = std::move(parameter->value);
            head.is_file = true;
        } else if (equal_ignoring_case(parameter->name, "filename*")) {
            extended = extended_value(parameter->value);
            if (!extended) return malformed("an extended file name is not UTF-8''…");
        }
    }
    if (broken || !named) return malformed("a part's disposition is not well-formed");
    if (extended) {  // RFC 6266 §4.3: preferred where both are given
        head.file_name = std::move(*extended);
        head.is_file = true;
    }
    return {};
}

Result<PartHead> read_part_head(std::string_view text) {
    PartHead head;
    bool found = false;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find("\r\n"), text.size());
        const std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 2, text.size()));
        const std::size_t colon = line.find(':');
        if (colon == std::string_view::npos) return malformed("a part's header line has no colon");
        if (!equal_ignoring_case(trimmed(line.substr(0, colon)), "Content-Disposition")) continue;
        if (found) return malformed("a part has two dispositions");
        found = true;
        QDUINO_TRY(read_disposition(trimmed(line.substr(colon + 1)), head));
    }
    if (!found) return malformed("a part has no disposition");
    return head;
}

}  // namespace

Result<std::string> boundary_of(std::string_view content_type) {
    const std::size_t semicolon = std::min(content_type.find(';'), content_type.size());
    if (!equal_ignoring_case(trimmed(content_type.substr(0, semicolon)), "multipart/form-data")) {
        return make_error(ErrorCode::unsupported, "send the file as multipart/form-data");
    }
    std::string_view rest = content_type.substr(semicolon);
    bool broken = false;
    while (std::optional<Parameter> parameter = take_parameter(rest, broken)) {
        if (!equal_ignoring_case(parameter->name, "boundary")) continue;
        if (!is_boundary(parameter->value)) break;
        return std::move(parameter->value);
    }
    return malformed("the boundary is missing or not well-formed");
}

MultipartParser::MultipartParser(std::string_view boundary, MultipartSink& sink, MultipartLimits limits)
    : delimiter_(std::string{"\r\n--"}.append(boundary)), sink_(sink), limits_(limits) {
    held_ = "\r\n";  // so that a boundary at the very start is found as any other
}

Result<void> MultipartParser::feed(std::span<const char> bytes) {
    if (state_ == State::failed) return malformed("nothing may follow an error");
    if (state_ == State::epilogue) return {};
    held_.append(bytes.data(), bytes.size());
    while (true) {
        const Result<bool> stepped = step();
        if (!stepped.ok()) {
            state_ = State::failed;
            return stepped.error();
        }
        if (!*stepped) break;
    }
    held_.erase(0, at_);
    at_ = 0;
    return {};
}

Result<void> MultipartParser::finish() const {
    if (state_ == State::epilogue) return {};
    return malformed("the upload ended before its end boundary; it was cut short");
}

Result<bool> MultipartParser::step() {
    switch (state_) {
        case State::preamble:
        case State::data:
            return step_to_delimiter();
        case State::after_delimiter:
            return step_after_delimiter();
        case State::headers:
            return step_headers();
        case State::epilogue:
            drop(held_.size() - at_);
            return false;
        case State::failed:
            break;
    }
    return false;
}

/// Preamble or data: gives out everything that cannot be a part of the delimiter.
Result<bool> MultipartParser::step_to_delimiter() {
    const std::size_t found = held_.find(delimiter_, at_);
    if (found != std::string::npos) {
        QDUINO_TRY(give_out(found - at_));
        drop(delimiter_.size());
        if (state_ == State::data) QDUINO_TRY(sink_.part_end());
        state_ = State::after_delimiter;
        return true;
    }
    const std::size_t available = held_.size() - at_;
    if (available >= delimiter_.size()) QDUINO_TRY(give_out(available - (delimiter_.size() - 1)));
    return false;
}

Result<void> MultipartParser::give_out(std::size_t count) {
    const std::span<const char> bytes{held_.data() + at_, count};
    drop(count);
    if (state_ == State::data) return count == 0 ? Result<void>{} : sink_.part_data(bytes);
    preamble_bytes_ += count;
    if (preamble_bytes_ > limits_.preamble_bytes_max)
        return malformed("there is no boundary at its beginning");
    return {};
}

/// `--` ends the whole; otherwise padding and CRLF begin a part (RFC 2046: transport-padding).
Result<bool> MultipartParser::step_after_delimiter() {
    const std::string_view rest = std::string_view{held_}.substr(at_);
    const std::size_t padding = std::min(rest.find_first_not_of(" \t"), rest.size());
    if (padding > 256) return malformed("a boundary is followed by too many blanks");
    if (rest.size() < padding + 2) return false;
    const std::string_view next = rest.substr(padding, 2);
    if (padding == 0 && next == "--") {
        drop(2);
        state_ = State::epilogue;
        return true;
    }
    if (next != "\r\n") return malformed("a boundary is not followed by a new line");
    if (++parts_ > limits_.parts_max) return too_large("too many parts");
    drop(padding);  // the CRLF stays: with an empty header block it is the first half of its end
    state_ = State::headers;
    return true;
}

Result<bool> MultipartParser::step_headers() {
    const std::string_view rest = std::string_view{held_}.substr(at_);
    const std::size_t end = rest.find("\r\n\r\n");
    if ((end == std::string_view::npos ? rest.size() : end) > limits_.header_bytes_max) {
        return too_large("a part's headers are too long");
    }
    if (end == std::string_view::npos) return false;
    QDUINO_TRY_ASSIGN(const PartHead head,
                      read_part_head(end < 2 ? std::string_view{} : rest.substr(2, end - 2)));
    drop(end + 4);
    QDUINO_TRY(sink_.part_begin(head));
    state_ = State::data;
    return true;
}

}  // namespace qduino::web
