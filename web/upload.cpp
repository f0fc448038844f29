#include "web/upload.h"

#include <algorithm>
#include <vector>

#include "spool/queue.h"

namespace qduino::web {

namespace {

constexpr std::size_t kFieldBytesMax = 4096;

class RawUpload final : public Upload {
  public:
    RawUpload(spool::Files& files, std::string name, std::map<std::string, std::string> fields)
        : Upload(files) {
        name_ = std::move(name);
        fields_ = std::move(fields);
    }
    Result<void> take(std::span<const char> bytes) override {
        if (!file_) QDUINO_TRY(begin_file(name_));
        return write_file(bytes);
    }

  private:
    Result<void> end() override { return {}; }
};

class MultipartUpload final : public Upload, private MultipartSink {
  public:
    MultipartUpload(spool::Files& files, std::string_view boundary)
        : Upload(files), parser_(boundary, *this) {}
    Result<void> take(std::span<const char> bytes) override { return parser_.feed(bytes); }

  private:
    Result<void> end() override { return parser_.finish(); }

    Result<void> part_begin(const PartHead& head) override {
        in_file_ = head.is_file;
        if (!in_file_) {
            field_ = head.name;
            return {};
        }
        if (head.name != "file")
            return make_error(ErrorCode::invalid_argument, "the file's part must be named \"file\"");
        if (file_) return make_error(ErrorCode::invalid_argument, "one upload brings one file");
        return begin_file(head.file_name);
    }
    Result<void> part_data(std::span<const char> bytes) override {
        if (in_file_) return write_file(bytes);
        std::string& value = fields_[field_];
        if (value.size() + bytes.size() > kFieldBytesMax) {
            return make_error(ErrorCode::invalid_argument, "a field beside the file is too long");
        }
        value.append(bytes.data(), bytes.size());
        return {};
    }
    Result<void> part_end() override { return {}; }

    MultipartParser parser_;
    std::string field_;
    bool in_file_ = false;
};

}  // namespace

Result<void> Upload::begin_file(std::string name) {
    QDUINO_TRY(spool::check_name(name));
    QDUINO_TRY_ASSIGN(file_, files_.stage());
    name_ = std::move(name);
    return {};
}

Result<void> Upload::write_file(std::span<const char> bytes) {
    QDUINO_TRY(file_->write(bytes));
    unread_.append(bytes.data(), bytes.size());
    return {};
}

std::optional<spool::Analysis> Upload::judge(spool::Analyzer& analyzer) {
    if (unread_.empty()) return std::nullopt;
    if (!reading_) reading_ = analyzer.begin(file_->layers());
    std::optional<spool::Analysis> refusal = reading_->feed(unread_);
    std::string{}.swap(unread_);
    return refusal;
}

Result<spool::Analysis> Upload::verdict(spool::Analyzer& analyzer) {
    if (std::optional<spool::Analysis> refusal = judge(analyzer)) return *refusal;
    return reading_->finish();
}

Result<void> Upload::finish() {
    QDUINO_TRY(end());
    if (!file_ || file_->size() == 0)
        return make_error(ErrorCode::invalid_argument, "the upload has no file, or an empty one");
    QDUINO_TRY(file_->seal());
    const std::string declared = field("sha256");
    if (!declared.empty() && !equal_ignoring_case(declared, file_->sha256())) {
        return make_error(ErrorCode::corrupt,
                          "the bytes have another SHA-256 than was declared; send them again");
    }
    return {};
}

Result<void> Upload::put_before(const std::string& lines) {
    QDUINO_TRY_ASSIGN(std::unique_ptr<spool::StagedFile> whole, files_.stage());
    QDUINO_TRY(whole->write(lines));
    const std::shared_ptr<const ByteSource> received = file_->content();
    if (!received) return make_error(ErrorCode::internal, "the upload cannot be read back");
    std::vector<char> bytes(64 * 1024);
    for (std::uint64_t at = 0;;) {
        QDUINO_TRY_ASSIGN(const std::size_t count, received->read_at(at, bytes));
        if (count == 0) break;
        QDUINO_TRY(whole->write(std::span{bytes}.first(count)));
        at += count;
    }
    QDUINO_TRY(whole->seal());
    reading_.reset();  // it packs into what goes now
    file_ = std::move(whole);
    return {};
}

Result<spool::Analysis> Upload::analyze(spool::Analyzer& analyzer) {
    const std::shared_ptr<const ByteSource> whole = file_->content();
    if (!whole) return make_error(ErrorCode::internal, "the uploaded file cannot be read back");
    return analyzer.analyze(*whole, file_->layers());
}

std::string Upload::field(const std::string& name) const {
    const auto at = fields_.find(name);
    return at == fields_.end() ? std::string{} : at->second;
}

Result<std::unique_ptr<Upload>> open_multipart(spool::Files& files, const RequestHead& head,
                                               const std::vector<std::string>&) {
    QDUINO_TRY_ASSIGN(const std::string boundary, boundary_of(head.value("Content-Type")));
    return std::unique_ptr<Upload>{std::make_unique<MultipartUpload>(files, boundary)};
}

Result<std::string> name_in_folder(std::string_view folder, std::string_view name) {
    if (folder.ends_with('/')) folder.remove_suffix(1);
    std::string whole;
    while (!folder.empty()) {
        const std::size_t end = std::min(folder.find('/'), folder.size());
        const std::string_view part = folder.substr(0, end);
        if (!spool::check_name(part))
            return make_error(ErrorCode::invalid_argument,
                              "path leads out of the job folder; leave it empty");
        whole.append(part).append(" - ");
        if (end + 1 == folder.size())
            return make_error(ErrorCode::invalid_argument, "path has an empty name");
        folder.remove_prefix(std::min(end + 1, folder.size()));
    }
    whole += name;
    QDUINO_TRY(spool::check_name(name));
    QDUINO_TRY(spool::check_name(whole));
    return whole;
}

Result<std::unique_ptr<Upload>> open_put(spool::Files& files, const RequestHead& head,
                                         const std::vector<std::string>& arguments) {
    const std::string_view path = arguments.back();
    const std::size_t slash = path.rfind('/');
    const bool in_folder = slash != std::string_view::npos;
    QDUINO_TRY_ASSIGN(std::string name, name_in_folder(in_folder ? path.substr(0, slash + 1) : "",
                                                       in_folder ? path.substr(slash + 1) : path));
    const bool print = trimmed(head.value("Print-After-Upload")) == "?1";
    std::map<std::string, std::string> fields{
        {"print", print ? "true" : "false"},
        {"sha256", std::string{trimmed(head.value("X-Content-SHA256"))}}};
    return std::unique_ptr<Upload>{std::make_unique<RawUpload>(files, std::move(name), std::move(fields))};
}

}  // namespace qduino::web
