#include "apps/metal_printer/memory_upload.h"

#include <utility>

namespace qduino::apps::metal {

namespace {

constexpr std::size_t kFieldBytesMax = 4096;

Error too_long() {
    return make_error(ErrorCode::out_of_range,
                      "the file is longer than this printer's memory for one: ", FilePlaces::kFileBytesMax,
                      " bytes");
}

}  // namespace

Result<std::unique_ptr<MemoryUpload>> MemoryUpload::open(const web::RequestHead& head,
                                                         const std::string& name, FileBytes place) {
    if (head.content_length.value_or(0) > FilePlaces::kFileBytesMax) return too_long();
    if (!place)
        return make_error(
            ErrorCode::unavailable,
            "this printer's memory is full of files that print, wait or come in; try again later");
    auto upload = std::make_unique<MemoryUpload>(std::move(place));
    if (name.empty()) {
        QDUINO_TRY_ASSIGN(const std::string boundary, web::boundary_of(head.value("Content-Type")));
        upload->parser_.emplace(boundary, static_cast<web::MultipartSink&>(*upload));
    } else {
        QDUINO_TRY(spool::check_name(name));
        upload->upload_.name = name;
        upload->fields_["print"] = web::trimmed(head.value("Print-After-Upload")) == "?1" ? "true" : "false";
        upload->fields_["sha256"] = web::trimmed(head.value("X-Content-SHA256"));
    }
    return upload;
}

Result<void> MemoryUpload::take(std::span<const char> bytes) {
    return parser_ ? parser_->feed(bytes) : add(bytes);
}

Result<void> MemoryUpload::add(std::span<const char> bytes) {
    if (upload_.bytes->size() + bytes.size() > FilePlaces::kFileBytesMax) return too_long();
    upload_.bytes->append(bytes.data(), bytes.size());
    hash_.add(bytes);
    return {};
}

Result<Uploaded> MemoryUpload::finish() {
    if (parser_) QDUINO_TRY(parser_->finish());
    if (upload_.bytes->empty())
        return make_error(ErrorCode::invalid_argument, "the upload has no file, or an empty one");
    upload_.sha256 = hash_.finish();
    const std::string& declared = fields_["sha256"];
    if (!declared.empty() && !web::equal_ignoring_case(declared, upload_.sha256))
        return make_error(ErrorCode::corrupt,
                          "the bytes have another SHA-256 than was declared; send them again");
    upload_.print = fields_["print"] == "true" || fields_["hold"] == "false";
    return std::move(upload_);
}

Result<void> MemoryUpload::part_begin(const web::PartHead& head) {
    field_ = nullptr;
    if (!head.is_file) {
        field_ = &fields_[head.name];
        return {};
    }
    if (head.name != "file" || !upload_.name.empty())
        return make_error(ErrorCode::invalid_argument, "one upload brings one file, named \"file\"");
    QDUINO_TRY(spool::check_name(head.file_name));
    upload_.name = head.file_name;
    return {};
}

Result<void> MemoryUpload::part_data(std::span<const char> bytes) {
    if (!field_) return add(bytes);
    if (field_->size() + bytes.size() > kFieldBytesMax)
        return make_error(ErrorCode::invalid_argument, "a field beside the file is too long");
    field_->append(bytes.data(), bytes.size());
    return {};
}

}  // namespace qduino::apps::metal
